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
  const double squared_sigmas = d.dot(weight.solve(d));
  factor_.add(squared_sigmas);
  const double fade = std::exp(-elapsed / kLagMemory);
  // Weighed as in the window: else what the estimate does not heed would ask for a change for good.
  const double length = std::sqrt(squared_sigmas);
  const double share = huber_threshold_ > 0.0 && length > huber_threshold_ ? huber_threshold_ / length : 1.0;
  const Eigen::Vector3d weighted_J = weight.solve(J);
  const double information = J.dot(weighted_J);
  information_ = fade * information_ + share * information;
  spread_ = fade * fade * spread_ + share * share * information;
  projection_ = fade * projection_ + share * d.dot(weighted_J);
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
    // Akaike's criterion: a change is worth its while where its square exceeds twice its variance.
    square += std::max(0.0, change * change - 2.0 * change_variance);
  }
  return std::sqrt(square);
}

}  // namespace rio_t
