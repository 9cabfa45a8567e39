#pragma once

#include <optional>
#include <vector>

#include "rio_t/factors/prior_factor.h"
#include "rio_t/factors/radar_velocity_factor.h"
#include "rio_t/imu/buffer.h"
#include "rio_t/imu/noise.h"
#include "rio_t/smoother/chain.h"
#include "rio_t/smoother/fixed_lag_smoother.h"
#include "rio_t/smoother/options.h"
#include "rio_t/smoother/solver_termination.h"
#include "rio_t/smoother/window.h"

namespace rio_t {

struct BatchOptions {
  int max_iterations = 100;  ///< of the solver, all together
  /// [s] A time of measurement that has come farther from its node places all nodes anew (imu model).
  double placement_tolerance = 1.0e-4;
};

/// What one scan gives to the graph.
struct BatchScan {
  Time stamp;
  double t_O = 0.0;                                  ///< [s] where to begin; places the node (imu model)
  std::optional<RadarVelocityMeasurement> velocity;  ///< none: not to be used
  std::optional<double> rest_velocity_sigma;         ///< [m/s] set where the platform is at rest
  bool offset_stepped = false;                       ///< t_O may have stepped since the scan before
};

struct BatchProblem {
  Time start;       ///< of the first node
  NodePrior prior;  ///< on it
  std::vector<BatchScan> scans;
  /// States to begin from, in the order of their times, at least one; the IMU carries them to the nodes.
  std::vector<NodeEstimate> guess;
};

struct BatchSolution {
  std::vector<NodeEstimate> nodes;
  std::vector<std::size_t> node_of_scan;  ///< for each scan of the problem
  std::vector<NodeMatrix> covariances;    ///< marginal, for each node
  ChainSystem normal_equations;           ///< at the solution
  int iterations = 0;                     ///< of the solver, all placements together
  int placements = 0;                     ///< how often the nodes were placed
  SolverTermination termination = SolverTermination::kIterationLimit;
  bool converged() const { return isConverged(termination); }
};

/// The graph of FixedLagSmoother over all the data at once: same factors, nothing marginalised, solved with
/// Ceres until the step that is left is shorter than a thousandth of a standard deviation in every direction.
/// With the imu model a node stands at the time of measurement of its scan, and the nodes are placed anew
/// where the offset has moved (docs/method.md, section 10).
class BatchSmoother {
 public:
  /// `imu` must outlive the smoother and cover all scans with max_time_offset to either side where it can.
  /// `g_W` is gravity in W [m/s^2].
  BatchSmoother(const SmootherOptions& options, const BatchOptions& batch, const ImuNoise& noise,
                const Eigen::Vector3d& g_W, const ImuBuffer& imu);

  /// Throws std::invalid_argument without a guess, std::runtime_error where the data leave a state open.
  BatchSolution solve(const BatchProblem& problem) const;

  /// Residual h - z of a velocity at `node`, whose marginal covariance is `covariance`.
  struct Residual {
    Eigen::Vector3d value;                  ///< [m/s]
    Eigen::Matrix3d prediction_covariance;  ///< of h alone [m^2/s^2]
    bool informs_offset = false;            ///< h changes with t_O by motion, not by noise of the IMU
  };
  Residual residual(const NodeEstimate& node, const NodeMatrix& covariance,
                    const RadarVelocityMeasurement& z) const;

 private:
  bool atMeasurement() const { return options_.time_offset_model == TimeOffsetModel::kImu; }
  /// The whole run as one window, and the node of each scan.
  struct Graph {
    Window window;
    std::vector<std::size_t> node_of_scan;
  };
  Graph place(const BatchProblem& problem, const std::vector<double>& t_O,
              const std::vector<NodeEstimate>& guess) const;

  SmootherOptions options_;  // all read-only after construction
  BatchOptions batch_;
  ImuNoise noise_;
  Eigen::Vector3d g_W_;
  const ImuBuffer* imu_;
};

/// Index of the node nearest to `time`; `nodes` in the order of their times, not empty.
std::size_t nearestNode(const std::vector<NodeEstimate>& nodes, Time time);

/// `x` at `from`, carried by the IMU to `to`, forwards or backwards, at its own biases.
StateBlock carried(const StateBlock& x, Time from, Time to, const ImuBuffer& imu, const Eigen::Vector3d& g_W);

}  // namespace rio_t
