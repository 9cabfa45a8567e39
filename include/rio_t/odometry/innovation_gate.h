#pragma once

#include <Eigen/Core>
#include <optional>

#include "rio_t/core/time.h"
#include "rio_t/radar/ego_velocity.h"
#include "rio_t/smoother/options.h"

namespace rio_t {

/// Rejects velocities that contradict what the IMU predicts (docs/method.md, eq. 30), and knows when not to:
/// a prediction that a wrong scan spoilt would reject all that could mend it. Not thread-safe.
class InnovationGate {
 public:
  explicit InnovationGate(const SmootherOptions& options) : options_(options) {}

  /// Of the innovation [m^2/s^2].
  Eigen::Matrix3d covariance(const VelocityPrior& prior, const EgoVelocity& measured) const;
  /// Whether `measured`, of the scan stamped `stamp`, is to be left out. It is not where the prediction is
  /// worth nothing (`tilt_is_known` false: it is not linear in roll and pitch), after
  /// `innovation_gate_timeout` without a scan, and after half a second of scans all points of which agree.
  bool rejects(Time stamp, const VelocityPrior& prior, const EgoVelocity& measured, bool tilt_is_known);
  /// A scan of that stamp is in the window.
  void used(Time stamp);

 private:
  SmootherOptions options_;  // read-only after construction
  Time last_used_;
  std::optional<Time> unanimous_since_;  ///< stamp of the first rejected scan since when all were unanimous
};

}  // namespace rio_t
