#include "rio_t/sensors/offset_uncertainty.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace rio_t {
namespace {

/// [s] Over this time a drift of 2 ms a minute adds up to 1.3 ms, more than the scatter of 400 scans.
constexpr double kMemory = 40.0;

}  // namespace

void OffsetUncertainty::add(const Innovation& innovation) {
  const double fade = fading(last_, innovation.stamp, kMemory);
  last_ = std::max(last_, innovation.stamp);
  const Eigen::Vector3d& d = innovation.d;
  const Eigen::LDLT<Eigen::Matrix3d> weight = innovation.S.ldlt();
  // The weights are those of the window: a scan that the window ignores would show a change for ever.
  const double length = std::sqrt(d.dot(weight.solve(d)));
  const double share = huber_threshold_ > 0.0 && length > huber_threshold_ ? huber_threshold_ / length : 1.0;
  const Eigen::Vector3d weighted_J = weight.solve(innovation.J_after);
  const double information = innovation.J_after.dot(weighted_J);
  information_ = fade * information_ + share * information;
  spread_ = fade * fade * spread_ + share * share * information;
  projection_ = fade * projection_ + share * d.dot(weighted_J);
}

double OffsetUncertainty::squaredLag() const {
  if (information_ <= 0.0) return 0.0;
  const double change = projection_ / information_;
  const double change_variance = spread_ / (information_ * information_);
  // Akaike's criterion accepts a change if its square exceeds twice its variance. On average, that square
  // exceeds the squared lag by the variance.
  const double excess = change * change - change_variance;
  return excess > change_variance ? excess : 0.0;
}

double OffsetUncertainty::sigma(double variance) const { return std::sqrt(variance + squaredLag()); }

double OffsetUncertainty::walk() const { return std::sqrt(squaredLag() / kMemory); }

}  // namespace rio_t
