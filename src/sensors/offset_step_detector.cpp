#include "rio_t/sensors/offset_step_detector.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "rio_t/core/fading.h"

namespace rio_t {

bool OffsetStepDetector::stepped(const Innovation& innovation) {
  if (!options_.enabled) return false;
  const double fade = fading(last_, innovation.stamp, options_.memory);
  last_ = innovation.stamp;
  const Eigen::LDLT<Eigen::Matrix3d> weight = innovation.S_at_offset.ldlt();
  const Eigen::Vector3d weighted_J = weight.solve(innovation.J_O);
  information_ = fade * information_ + innovation.J_O.dot(weighted_J);
  projection_ = fade * projection_ + innovation.d.dot(weighted_J);
  squares_ = fade * squares_ + innovation.d.dot(weight.solve(innovation.d));
  count_ = fade * count_ + 3.0;
  if (count_ < 30.0 || information_ <= 0.0) return false;

  const double change = projection_ / information_;
  // The scatter that the change does not explain. S is an upper bound, so the scatter may well be below 1.
  const double scatter = std::max(0.2, (squares_ - change * projection_) / count_);
  const double sigma = std::sqrt(scatter / information_);
  if (std::abs(change) < options_.significance * sigma || std::abs(change) < options_.min_change)
    return false;
  *this = OffsetStepDetector(options_);
  return true;
}

}  // namespace rio_t
