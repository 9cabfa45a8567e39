#pragma once

#include <ceres/loss_function.h>

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rio_t/core/pose.h"
#include "rio_t/factors/constant_offset_factor.h"
#include "rio_t/factors/imu_factor.h"
#include "rio_t/factors/prior_factor.h"
#include "rio_t/factors/radar_velocity_factor.h"
#include "rio_t/factors/rest_factor.h"
#include "rio_t/factors/state_manifold.h"
#include "rio_t/imu/buffer.h"
#include "rio_t/radar/ego_velocity.h"
#include "rio_t/smoother/chain.h"
#include "rio_t/smoother/options.h"

namespace rio_t {

/// One node of the window as others see it.
struct NodeEstimate {
  Time time;
  StateBlock x;
  double t_O = 0.0;  ///< [s]
};

struct SolveReport {
  int iterations = 0;
  bool converged = false;
};

/// What a scan should show, see FixedLagSmoother::predictRadarVelocity.
struct RadarVelocityPrediction {
  VelocityPrior velocity;  ///< with the uncertainty of everything
  Eigen::Matrix3d covariance_at_offset =
      Eigen::Matrix3d::Zero();                        ///< the same, were the offset known [m^2/s^2]
  Eigen::Vector3d dv_dt_O = Eigen::Vector3d::Zero();  ///< of v_R with respect to t_O [m/s^2]
};

/// The paper's factor graph over the last `window` seconds, solved with Ceres; what leaves is marginalised.
///
/// Nodes are in the order of their times, whatever the order of arrival. Not thread-safe.
class FixedLagSmoother {
 public:
  enum class AddResult { kAdded, kOlderThanWindow, kDuplicateStamp };

  /// `imu` must outlive the smoother and keep what `imuNeededSince` says. `g_W` is gravity in W [m/s^2].
  FixedLagSmoother(const SmootherOptions& options, const ImuNoise& noise, const Eigen::Vector3d& g_W,
                   const ImuBuffer& imu);

  /// Starts (or starts again) with one node at `time`, at the prior's own x0 and t_O0.
  void initialize(Time time, const NodePrior& prior);

  /// Where a scan stamped `stamp` puts its node: the stamp (constant_acceleration), or the time of
  /// measurement as now estimated (imu). The IMU must cover it before `add`.
  Time nodeTime(Time stamp) const;

  /// Radar velocity that a scan stamped `stamp` should show, with the uncertainty of the state, of the IMU
  /// since and of the offset. None for a scan older than the newest node. R_RI turns I into R, `l_I` is the
  /// radar in I [m].
  std::optional<RadarVelocityPrediction> predictRadarVelocity(Time stamp, const Eigen::Matrix3d& R_RI,
                                                              const Eigen::Vector3d& l_I) const;
  AddResult add(const RadarVelocityMeasurement& z);
  /// The platform is at rest at the time of measurement of a scan stamped `stamp`; `velocity_sigma` [m/s].
  AddResult addRest(Time stamp, double velocity_sigma);
  /// Forgets how well t_O is known from the next node on, where it must have stepped: its prior sigma comes
  /// back.
  void loosenTimeOffset() { offset_has_stepped_ = true; }
  SolveReport optimize();
  /// Marginalises what is older than the window; the nodes that left, oldest first.
  std::vector<NodeEstimate> marginalize();

  std::size_t size() const { return nodes_.size(); }
  NodeEstimate node(std::size_t k) const { return {nodes_[k].time, nodes_[k].x, nodes_[k].t_O}; }
  NodeEstimate newest() const { return node(nodes_.size() - 1); }
  /// Marginal covariance of the newest node after the last `optimize` (or `initialize`).
  const NodeMatrix& newestCovariance() const { return newest_covariance_; }
  /// Samples of the IMU before this time are not needed any more.
  Time imuNeededSince() const;

 private:
  struct RadarTerm {
    Time stamp;
    std::unique_ptr<ceres::CostFunction> cost;
  };
  struct Node {
    Time time;
    StateBlock x;
    double t_O = 0.0;
    std::unique_ptr<ImuFactor> imu_from_previous;                ///< null for the first node
    std::unique_ptr<ConstantOffsetFactor> offset_from_previous;  ///< null for the first node
    std::vector<RadarTerm> radar;
    std::unique_ptr<RestFactor> rest;  ///< null where the platform is not known to be at rest
  };

  /// The node at `time`, made if need be; null where `time` lies before the window.
  Node* nodeAt(Time time);
  Node makeNode(Time time, const Node& previous) const;
  void linkToPrevious(std::size_t k);
  std::unique_ptr<ceres::CostFunction> makeRadarFactor(const RadarVelocityMeasurement& z,
                                                       Time node_time) const;
  ChainSystem linearize() const;
  double offsetVariance(double dt) const;  ///< that t_O gains in dt [s] by its random walk [s^2]

  SmootherOptions options_;  // these four: read-only after construction
  ImuNoise noise_;
  Eigen::Vector3d g_W_;
  const ImuBuffer* imu_;
  std::unique_ptr<ceres::LossFunction> loss_;  // null: none
  StateManifold manifold_;
  std::unique_ptr<PriorFactor> prior_;  // on the first node
  std::deque<Node> nodes_;
  bool offset_has_stepped_ = false;
  NodeMatrix newest_covariance_ = NodeMatrix::Zero();
};

/// Empty for kAdded, else why not, in snake case.
std::string toString(FixedLagSmoother::AddResult result);

}  // namespace rio_t
