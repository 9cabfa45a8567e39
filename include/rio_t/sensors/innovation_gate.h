#pragma once

#include <optional>

#include "rio_t/core/time.h"
#include "rio_t/sensors/innovation.h"
#include "rio_t/smoother/options.h"

namespace rio_t {

/// Rejects velocities that contradict the prediction (docs/method.md, eq. 30). The gate opens if the
/// prediction itself may be wrong; otherwise a prediction that one wrong scan spoilt would reject every
/// correct one. Not thread-safe.
class InnovationGate {
 public:
  /// Whether to reject a scan, by the options innovation_*. The gate is open if `tilt_is_known` is false (the
  /// prediction is not linear in roll and pitch), `innovation_gate_timeout` after the scan stamped
  /// `last_used` was used, whatever radar it is from, and after half a second of unanimous scans (nearly all
  /// points of each agree).
  bool rejects(const SmootherOptions& options, const Innovation& innovation, bool is_unanimous,
               bool tilt_is_known, Time last_used);
  /// The scan was used.
  void used() { unanimous_since_.reset(); }

 private:
  std::optional<Time> unanimous_since_;  ///< first stamp of the run of unanimous rejected scans
};

}  // namespace rio_t
