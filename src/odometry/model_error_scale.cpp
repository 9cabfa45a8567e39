#include "rio_t/odometry/model_error_scale.h"

#include <algorithm>
#include <cmath>

namespace rio_t {
namespace {

/// Prior information about the logarithm of the scale: the options are right within a factor of 1.6.
constexpr double kBelief = 1.0;
/// [s] The errors change with the surroundings and with the kind of motion. 200 scans show the scale to 7 %.
constexpr double kMemory = 20.0;
/// Bounds: a tenth and ten times the sigmas of the options. Below, only the measured noise matters.
constexpr double kSmallest = 0.01;
constexpr double kLargest = 100.0;
/// One innovation counts at most as four sigma, since it may be an outlier.
constexpr double kLargestSquare = 16.0;

}  // namespace

void ModelErrorScale::add(Time stamp, double squared_sigmas, double share) {
  const double fade = fading(last_, stamp, kMemory);
  last_ = std::max(last_, stamp);
  information_ = fade * information_ + 1.5 * share * share;
  const double excess = std::clamp(squared_sigmas, 0.0, kLargestSquare) - 3.0;
  // Newton's step uses the actual curvature. With the expected one, a single outlier would count tenfold.
  const double curvature = information_ + 0.5 * share * share * std::max(0.0, excess);
  value_ *= std::exp(0.5 * share * excess / (kBelief + curvature));
  value_ = std::clamp(value_, kSmallest, kLargest);
}

}  // namespace rio_t
