#include "rio_t/sensors/innovation_gate.h"

#include <cmath>

namespace rio_t {
namespace {

constexpr double kUnanimousTime = 0.5;  // [s] of unanimous scans: a single one may be chance

}  // namespace

bool InnovationGate::rejects(const InnovationGateOptions& options, const Innovation& innovation,
                             const EgoVelocity& velocity, bool tilt_is_known, Time last_used) {
  const double gate = options.sigmas;
  const Time stamp = innovation.stamp;
  if (gate == 0.0 || innovation.widened(options.model_error).squaredSigmas() <= gate * gate) return false;
  if (!tilt_is_known) return false;
  // A few ghosts agree on a velocity by chance now and then, but seldom most points.
  if (std::abs(stamp - last_used) > options.timeout && hasMajority(velocity)) return false;
  if (!isUnanimous(velocity)) {
    unanimous_since_.reset();
  } else if (!unanimous_since_) {
    unanimous_since_ = stamp;
  }
  return !unanimous_since_ || std::abs(stamp - *unanimous_since_) < kUnanimousTime;
}

}  // namespace rio_t
