#pragma once

#include <optional>
#include <string>
#include <vector>

#include "rio_t/core/pose.h"
#include "rio_t/factors/radar_velocity_factor.h"
#include "rio_t/imu/buffer.h"
#include "rio_t/radar/ego_velocity.h"
#include "rio_t/smoother/factor_pool.h"
#include "rio_t/smoother/options.h"
#include "rio_t/smoother/window.h"
#include "rio_t/smoother/window_solver.h"

namespace rio_t {

/// One node of the window as others see it.
struct NodeEstimate {
  Time time;
  StateBlock x;
  double t_O = 0.0;  ///< [s]
};

/// What a scan should show, see FixedLagSmoother::predictRadarVelocity.
struct RadarVelocityPrediction {
  VelocityPrior velocity;  ///< with the uncertainty of everything
  Eigen::Matrix3d covariance_at_offset =
      Eigen::Matrix3d::Zero();                        ///< the same, were the offset known [m^2/s^2]
  Eigen::Vector3d dv_dt_O = Eigen::Vector3d::Zero();  ///< of v_R with respect to t_O [m/s^2]
  double t_O = 0.0;                                   ///< at which all this holds [s]
  /// Per axis, of the noise in dv_dt_O times the error of the offset: not in the covariances [m^2/s^2].
  double rate_variance = 0.0;
  bool informs_offset = false;  ///< dv_dt_O is motion, not noise of the IMU
  double tilt_sigma = 0.0;      ///< of roll and pitch, the larger [rad]
};

/// The paper's factor graph over the last `window` seconds; what leaves is marginalised.
///
/// Nodes are in the order of their times, whatever the order of arrival. Not thread-safe.
class FixedLagSmoother {
 public:
  enum class AddResult { kAdded, kOlderThanWindow, kDuplicateStamp };

  /// `imu` must outlive the smoother and keep what `imuNeededSince` says. `g_W` is gravity in W [m/s^2].
  FixedLagSmoother(const SmootherOptions& options, const ImuNoise& noise, const Eigen::Vector3d& g_W,
                   const ImuBuffer& imu);

  /// Noise of the IMU from here on.
  void setImuNoise(const ImuNoise& noise);
  /// Random walk of t_O from here on [s/sqrt(s)].
  void setTimeOffsetNoise(double noise) { options_.time_offset_noise = noise; }
  /// Starts (or starts again) with one node at `time`, at the prior's own x0 and t_O0.
  void initialize(Time time, const NodePrior& prior);

  /// Where a scan stamped `stamp` puts its node: the stamp (constant_acceleration), or the time of
  /// measurement as now estimated (imu). The IMU must cover it before `add`.
  Time nodeTime(Time stamp) const;

  /// Radar velocity that a scan stamped `stamp` should show, with the uncertainty of the state, of the IMU
  /// since and of the offset: from the newest node before it. None for a scan older than the window. R_RI
  /// turns I into R, `l_I` is the radar in I [m].
  std::optional<RadarVelocityPrediction> predictRadarVelocity(Time stamp, const Eigen::Matrix3d& R_RI,
                                                              const Eigen::Vector3d& l_I) const;
  AddResult add(const RadarVelocityMeasurement& z);
  /// The platform is at rest at the time of measurement of a scan stamped `stamp`; `velocity_sigma` [m/s].
  AddResult addRest(Time stamp, double velocity_sigma);
  /// A node at `time` without a measurement, later than the newest: so the window moves on while no scan
  /// comes.
  void carryTo(Time time) { nodeAt(time); }
  /// The offset stepped before the scan stamped `stamp`: from that scan on t_O is as uncertain as at the
  /// start.
  void loosenTimeOffset(Time stamp) {
    offset_stepped_at_ = stamp;
    offset_step_is_new_ = true;
  }
  /// `short_step`: see SolverLimits.
  SolveReport optimize(double short_step = SolverLimits().short_step);
  /// Marginalises what is older than the window; the nodes that left, oldest first, until the next call.
  const std::vector<NodeEstimate>& marginalize();

  std::size_t size() const { return window_.nodes.size(); }
  NodeEstimate node(std::size_t k) const {
    return {window_.nodes[k].time, window_.nodes[k].x, window_.nodes[k].t_O};
  }
  NodeEstimate newest() const { return node(window_.nodes.size() - 1); }
  /// Marginal covariance of the newest node after the last `optimize` (or `initialize`).
  const NodeMatrix& newestCovariance() const { return newest_covariance_; }
  /// Samples of the IMU before this time are not needed any more.
  Time imuNeededSince() const;

 private:
  /// The node at `time`, made if need be; null where `time` lies before the window.
  WindowNode* nodeAt(Time time);
  /// The node of a scan, at its time of measurement; null likewise.
  WindowNode* nodeOf(Time stamp);
  /// Index of the newest node that is not later than `time`; `time` is not before the window.
  std::size_t nodeBefore(Time time) const;
  /// Marginal covariance of node k.
  NodeMatrix covarianceOf(std::size_t k) const;
  /// Moves the link that a step of the offset loosened, so that the scan of node k lies behind it.
  void placeOffsetStep(std::size_t k);
  WindowNode makeNode(Time time, const WindowNode& previous);
  void linkToPrevious(std::size_t k);
  /// From `node` to `to` with the biases of `node`. A scan asks for the same one three times: for its
  /// prediction, its node and its factor.
  const Preintegration& preintegrateFrom(const WindowNode& node, Time to) const;
  double offsetVariance(double dt) const;  ///< that t_O gains in dt [s] by its random walk [s^2]

  SmootherOptions options_;  // read-only after construction, as the next but one and the one after
  ImuNoise noise_;
  Eigen::Vector3d g_W_;
  const ImuBuffer* imu_;
  Window window_;
  WindowSolver solver_;
  struct LastPreintegration {
    Time from, to;
    Preintegration value;
  };
  // These two change no result.
  mutable LastPreintegration last_preintegration_;
  mutable FactorPool pool_;
  ChainSystem leaving_{2};  // a node that leaves and its neighbour
  std::vector<NodeEstimate> left_;
  std::optional<Time> offset_stepped_at_;  ///< stamp of the first scan behind the latest step
  bool offset_step_is_new_ = false;        ///< no node lies behind it yet
  NodeMatrix newest_covariance_ = NodeMatrix::Zero();
};

/// Empty for kAdded, else why not, in snake case.
std::string toString(FixedLagSmoother::AddResult result);

}  // namespace rio_t
