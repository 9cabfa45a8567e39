#pragma once

#include <optional>
#include <vector>

#include "rio_t/factors/motion_manifold.h"
#include "rio_t/graph/marginalization.h"
#include "rio_t/graph/solver.h"
#include "rio_t/graph/window.h"
#include "rio_t/imu/buffer.h"
#include "rio_t/imu/noise.h"
#include "rio_t/imu/preintegration.h"
#include "rio_t/smoother/node_estimate.h"
#include "rio_t/smoother/options.h"

namespace rio_t {

/// [s] A scan this near to a node shares the node: an IMU factor over no time would have infinite weight.
double minNodeSpacing(TimeOffsetModel model);

/// A state carried to a time, with the joint covariance of it and of calibration blocks, in this order.
struct PredictedState {
  StateBlock x;
  Eigen::MatrixXd covariance;
};

/// The states of the last `window` seconds, linked by the IMU. Older states are marginalised. Sensors add
/// their terms and calibration blocks to its window (paper, Fig. 2). All nodes share one block of biases.
/// When a node leaves, biases and calibration get the random walk of its interval.
///
/// Nodes are in the order of their times, whatever the order of arrival. Not thread-safe.
class FixedLagSmoother {
 public:
  /// `imu` must outlive the smoother and keep what `imuNeededSince` says. `g_W` is gravity in W [m/s^2].
  FixedLagSmoother(const SmootherOptions& options, const ImuNoise& noise, const Eigen::Vector3d& g_W,
                   const ImuBuffer& imu);

  /// Sets the noise of the IMU for all later factors and random walks.
  void setImuNoise(const ImuNoise& noise);
  /// Starts, or starts again, with one node and biases that have no prior yet. The caller adds calibration
  /// blocks and priors and then calls `settle`.
  Block& start(Time time, const StateBlock& x0);
  /// Computes the covariances without a solve: after a start, and after a calibration block was added.
  void settle() { solution_ = linearized(window_); }
  bool started() const { return !nodes_.empty(); }

  Window& window() { return window_; }
  /// The biases that all nodes share. Only after start.
  Block& biases() { return *biases_; }
  /// The node at `time`, or within minNodeSpacing of it; created if there is none. Null if `time` is before
  /// the window. The IMU must cover `time`.
  Block* nodeAt(Time time);
  /// The state at `time`, carried there from the newest node before it. None if `time` is before the window.
  std::optional<PredictedState> predict(Time time, const std::vector<const Block*>& calibration) const;
  /// The newest node that is not later than `time`. None if `time` is before the window.
  std::optional<NodeEstimate> nodeBefore(Time time) const;
  /// Adds a prior on calibration blocks that join a running window, with the sigmas of their tangents. It
  /// does not constrain the newest node, but leaves the window with it. From then on the blocks walk.
  void addCalibrationPrior(std::vector<Block*> calibration, const Eigen::VectorXd& sigmas);
  /// Constrains a node to rest; `velocity_sigma` [m/s] per axis.
  void addZeroVelocity(Block& node, double velocity_sigma);

  /// Adds a drift of the position with this variance per axis [m^2], from the next `marginalize` on.
  void addDrift(double variance) { drifted_ += variance; }

  const Solution& optimize();
  /// Random walk of a calibration block.
  struct RandomWalk {
    const Block* block;
    Eigen::VectorXd density;  ///< of each direction of its tangent [unit/sqrt(s)]
  };
  /// Marginalises the nodes that are older than the window and returns them, oldest first. A retired
  /// calibration block leaves with the last node that shares a term with it.
  std::vector<NodeEstimate> marginalize(const std::vector<RandomWalk>& walks);

  std::size_t size() const { return nodes_.size(); }
  NodeEstimate node(std::size_t k) const;
  NodeEstimate newest() const { return node(nodes_.size() - 1); }
  std::vector<NodeEstimate> nodes() const;
  /// Joint covariance of the newest node, the biases and calibration blocks, as of the last `optimize` or
  /// `settle`.
  Eigen::MatrixXd newestCovariance(const std::vector<const Block*>& calibration) const;
  /// Samples of the IMU before this time are not needed any more.
  Time imuNeededSince() const;

 private:
  struct Node {
    Block* motion = nullptr;
    const Term* imu_from_previous = nullptr;  ///< none at the first node
    const Term* zero_velocity = nullptr;
    Time time() const { return *motion->time; }
  };

  /// Index of the newest node that is not later than `time`; `time` is not before the window.
  std::size_t indexBefore(Time time) const;
  void linkToPrevious(std::size_t k);
  Eigen::MatrixXd covarianceOf(const Block& node, const std::vector<const Block*>& calibration) const;
  std::vector<const Block*> leavingWith(const Block& node) const;
  /// From `node` to `to`. Cached, since a scan needs the same one for its prediction and for its node.
  const Preintegration& preintegrateFrom(const Node& node, Time to) const;

  SmootherOptions options_;  // read-only after construction, as g_W_, imu_ and the manifolds
  ImuNoise noise_;
  Eigen::Vector3d g_W_;
  const ImuBuffer* imu_;
  std::shared_ptr<const Manifold> motion_manifold_, bias_manifold_;
  Window window_;
  std::shared_ptr<Block> biases_;
  std::vector<Node> nodes_;
  double drifted_ = 0.0;  ///< [m^2] drift that no prior contains yet
  Solution solution_;     ///< of the last solve
  struct LastPreintegration {
    Time from, to;
    Preintegration value;
  };
  mutable LastPreintegration last_preintegration_;  ///< a cache
};

/// Variances that the biases gain in `dt` seconds: b_g, then b_a.
Eigen::VectorXd biasWalkVariance(const ImuNoise& noise, double dt);
/// The state that a node and the biases make, and its two parts as the blocks store them.
StateBlock stateOf(const Block& motion, const Block& biases);
Eigen::VectorXd storedMotion(const StateBlock& x);
Eigen::VectorXd storedBiases(const StateBlock& x);

}  // namespace rio_t
