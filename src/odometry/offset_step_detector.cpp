#include "rio_t/odometry/offset_step_detector.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace rio_t {

bool OffsetStepDetector::stepped(Time stamp, const Eigen::Vector3d& innovation, const Eigen::Matrix3d& S,
                            const Eigen::Vector3d& J) {
  if (!options_.enabled) return false;
  const double fade = std::exp(-std::clamp(stamp - last_, 0.0, 10.0 * options_.memory) / options_.memory);
  last_ = stamp;
  const auto weight = S.ldlt();
  const Eigen::Vector3d weighted_J = weight.solve(J);
  information_ = fade * information_ + J.dot(weighted_J);
  projection_ = fade * projection_ + innovation.dot(weighted_J);
  squares_ = fade * squares_ + innovation.dot(weight.solve(innovation));
  count_ = fade * count_ + 3.0;
  if (count_ < 30.0 || information_ <= 0.0) return false;

  const double change = projection_ / information_;
  // The scatter that the change itself does not explain; S is a bound on the safe side, so it may well be
  // below 1.
  const double scatter = std::max(0.2, (squares_ - change * projection_) / count_);
  const double sigma = std::sqrt(scatter / information_);
  if (std::abs(change) < options_.significance * sigma || std::abs(change) < options_.min_change)
    return false;
  *this = OffsetStepDetector(options_);
  return true;
}

}  // namespace rio_t
