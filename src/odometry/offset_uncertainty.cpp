#include "rio_t/odometry/offset_uncertainty.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace rio_t {
namespace {

constexpr double kFactorMemory = 60.0;  // [s]
constexpr double kLagMemory = 40.0;     // [s]

}  // namespace

void OffsetUncertainty::add(Time stamp, const Eigen::Vector3d& d, const Eigen::Matrix3d& S,
                            const Eigen::Vector3d& J) {
  const double elapsed = std::clamp(stamp - last_, 0.0, 10.0 * kFactorMemory);
  last_ = stamp;
  const auto weight = S.ldlt();
  factor_.fade(std::exp(-elapsed / kFactorMemory));
  factor_.add(d.dot(weight.solve(d)));
  const double fade = std::exp(-elapsed / kLagMemory);
  const Eigen::Vector3d weighted_J = weight.solve(J);
  information_ = fade * information_ + J.dot(weighted_J);
  spread_ = fade * fade * spread_ + J.dot(weighted_J);
  projection_ = fade * projection_ + d.dot(weighted_J);
}

void OffsetUncertainty::offsetStepped() {
  information_ = 0.0;
  spread_ = 0.0;
  projection_ = 0.0;
}

double OffsetUncertainty::sigma(double variance) const {
  const double factor = factor_.value();
  double square = factor * variance;
  if (information_ > 0.0) {
    const double change = projection_ / information_;
    const double change_variance = factor * spread_ / (information_ * information_);
    square += std::max(0.0, change * change - change_variance);
  }
  return std::sqrt(square);
}

}  // namespace rio_t
