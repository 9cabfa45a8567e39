#include "rio_t/sensors/innovation_gate.h"

#include <cmath>

namespace rio_t {
namespace {

constexpr double kUnanimousTime = 0.5;  // [s] of scans that are unanimous: one may be chance

}  // namespace

bool InnovationGate::rejects(const InnovationGateOptions& options, const Innovation& innovation,
                             bool is_unanimous, bool tilt_is_known, Time last_used) {
  const double gate = options.sigmas;
  const Time stamp = innovation.stamp;
  if (gate == 0.0 || innovation.widened(options.model_error).squaredSigmas() <= gate * gate) return false;
  if (!tilt_is_known || std::abs(stamp - last_used) > options.timeout) return false;
  if (!is_unanimous) {
    unanimous_since_.reset();
  } else if (!unanimous_since_) {
    unanimous_since_ = stamp;
  }
  return !unanimous_since_ || std::abs(stamp - *unanimous_since_) < kUnanimousTime;
}

}  // namespace rio_t
