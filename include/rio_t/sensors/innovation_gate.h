#pragma once

#include <optional>

#include "rio_t/core/time.h"
#include "rio_t/radar/ego_velocity.h"
#include "rio_t/sensors/innovation.h"

namespace rio_t {

struct InnovationGateOptions {
  /// A scan farther than this many sigmas from the prediction is rejected. The sigma includes that of the
  /// offset. 0 = no gate.
  double sigmas = 4.0;
  /// [m/s] Added to the sigma of each axis of the innovation, for gate and health only. It stands for small
  /// errors of the extrinsics and of the IMU's scale.
  double model_error = 0.1;
  /// [s] without a used scan; then the gate accepts the next one in which most points agree.
  double timeout = 3.0;
};

/// Rejects velocities that contradict the prediction (docs/method.md, eq. 30). The gate opens if the
/// prediction itself may be wrong. Otherwise, after a wrong scan was accepted, the gate might reject all
/// correct ones. Not thread-safe.
class InnovationGate {
 public:
  /// Whether to reject a scan of that `velocity`. The gate is open if `tilt_is_known` is false (the
  /// prediction is not linear in roll and pitch). `options.timeout` after the scan stamped `last_used` was
  /// used, whatever radar it is from, it is open if most points agree. After half a second of unanimous scans
  /// (nearly all points of each agree) it is open, too.
  bool rejects(const InnovationGateOptions& options, const Innovation& innovation,
               const EgoVelocity& velocity, bool tilt_is_known, Time last_used);
  /// Call it if the scan was used.
  void used() { unanimous_since_.reset(); }

 private:
  std::optional<Time> unanimous_since_;  ///< first stamp of the run of unanimous rejected scans
};

}  // namespace rio_t
