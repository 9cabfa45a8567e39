#include "rio_t/odometry/variance_factor.h"

#include <algorithm>
#include <cmath>

namespace rio_t {
namespace {

/// Innovations that the options are worth. With ten the factor is known to a quarter, its own scatter.
constexpr double kBelief = 10.0;
/// [s] Noise changes with the surroundings, not with the motion.
constexpr double kMemory = 60.0;

}  // namespace

void VarianceFactor::add(Time stamp, double squared_sigmas) {
  const double fade = std::exp(-std::clamp(stamp - last_, 0.0, 10.0 * kMemory) / kMemory);
  last_ = stamp;
  squares_ = fade * squares_ + squared_sigmas / 3.0;
  count_ = fade * count_ + 1.0;
}

double VarianceFactor::value() const { return (kBelief + squares_) / (kBelief + count_); }

}  // namespace rio_t
