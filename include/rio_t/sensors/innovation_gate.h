#pragma once

#include <optional>

#include "rio_t/core/time.h"
#include "rio_t/sensors/innovation.h"
#include "rio_t/smoother/options.h"

namespace rio_t {

/// Rejects velocities that contradict what the IMU predicts (docs/method.md, eq. 30), and knows when not to:
/// a prediction that a wrong scan spoilt would reject all that could mend it. Not thread-safe.
class InnovationGate {
 public:
  explicit InnovationGate(const SmootherOptions& options) : options_(options) {}

  /// Whether a scan is to be left out. It is not where the prediction is worth nothing (`tilt_is_known` false:
  /// it is not linear in roll and pitch), after `innovation_gate_timeout` without a scan, and after half a
  /// second of scans that are unanimous: all points of them agree.
  bool rejects(const Innovation& innovation, bool is_unanimous, bool tilt_is_known);
  /// A scan of that stamp is in the window.
  void used(Time stamp);

 private:
  SmootherOptions options_;  // read-only after construction
  Time last_used_;
  std::optional<Time> unanimous_since_;  ///< stamp of the first rejected scan since when all were unanimous
};

}  // namespace rio_t
