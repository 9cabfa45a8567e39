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
  explicit InnovationGate(const SmootherOptions& options) : options_(options) {}

  /// Whether to reject a scan. The gate is open if `tilt_is_known` is false (the prediction is not linear in
  /// roll and pitch), after `innovation_gate_timeout` without a used scan, and after half a second of
  /// unanimous scans (nearly all points of each agree).
  bool rejects(const Innovation& innovation, bool is_unanimous, bool tilt_is_known);
  /// The scan with this stamp was used.
  void used(Time stamp);

 private:
  SmootherOptions options_;  // read-only after construction
  Time last_used_;
  std::optional<Time> unanimous_since_;  ///< first stamp of the run of unanimous rejected scans
};

}  // namespace rio_t
