#pragma once

#include <map>
#include <optional>
#include <vector>

#include "rio_t/factors/doppler_factor.h"
#include "rio_t/factors/radar_velocity_factor.h"
#include "rio_t/graph/solver.h"
#include "rio_t/imu/buffer.h"
#include "rio_t/imu/noise.h"
#include "rio_t/smoother/fixed_lag_smoother.h"
#include "rio_t/smoother/node_prior.h"
#include "rio_t/smoother/options.h"

namespace rio_t {

struct BatchOptions {
  int max_iterations = 100;  ///< of the solver, all together
  /// [s] If a time of measurement moves farther from its node, all nodes are placed again (imu model).
  double placement_tolerance = 1.0e-4;
};

/// Input of one scan to the graph.
struct BatchScan {
  Time stamp;
  std::size_t radar = 0;
  double t_O = 0.0;  ///< [s] initial value; also places the node (imu model)
  std::optional<RadarVelocityMeasurement> velocity;
  std::optional<DopplerMeasurement> doppler;  ///< instead of the velocity; neither: the scan is not used
  std::optional<double> rest_velocity_sigma;  ///< [m/s] set if the platform is at rest
  bool moves_as_vehicle = false;              ///< its node gets the constraint of the vehicle
  bool offset_stepped = false;                ///< t_O may have stepped since the scan before

  /// Null if the scan is not used.
  const RadarScanTime* measurement() const {
    if (doppler) return &*doppler;
    return velocity ? &*velocity : nullptr;
  }
};

/// A vehicle on wheels, as for GroundVehicleFactor.
struct BatchVehicle {
  Extrinsics T_IV;              ///< the vehicle frame, as configured
  double rotation_sigma = 0.0;  ///< [rad] prior on its rotation, about each axis
  /// [rad] of the ground at the first node, as for LevelGroundFactor; 0: not known
  double start_slope_sigma = 0.0;
  Eigen::Vector2d sigmas;  ///< [m/s] sideways and vertical
};

/// A mean of barometric heights, as for BarometerFactor.
struct BatchHeight {
  Time time;
  double height = 0.0, sigma = 0.0;  ///< [m]
  bool stepped = false;              ///< the bias may have stepped since the mean before
};

struct BatchProblem {
  Time start;             ///< of the first node
  NodePrior prior;        ///< on the first node, and on the calibration of `radar`
  std::size_t radar = 0;  ///< index of the radar in `prior`
  std::vector<CalibrationPrior> radars;
  std::vector<BatchScan> scans;
  std::optional<BatchVehicle> vehicle;
  std::vector<BatchHeight> heights;  ///< in order of time
  double barometer_drift = 0.0;      ///< [m/sqrt(s)] random walk of the bias of `heights`
  /// Initial states in order of time, at least one. The IMU carries them to the nodes.
  std::vector<NodeEstimate> guess;
};

struct BatchSolution {
  /// Result for one scan of the problem.
  struct Scan {
    std::size_t node = 0;
    double t_O = 0.0;  ///< [s]
    /// Joint, of the node's state, t_O and the estimated extrinsics of the radar.
    Eigen::MatrixXd covariance;
  };
  std::vector<NodeEstimate> nodes;
  std::vector<StateCovariance> covariances;  ///< marginal, of each node
  std::vector<Scan> scans;
  std::vector<Extrinsics> extrinsics;  ///< of each radar
  /// Of each radar, in the tangent of ExtrinsicsManifold; empty if the extrinsics are not estimated.
  std::vector<Eigen::MatrixXd> extrinsics_covariances;
  /// The frame of the vehicle, if there is one, and the sigmas of its rotation [rad] about the axes of I.
  std::optional<Extrinsics> T_IV;
  Eigen::Vector3d q_IV_sigma = Eigen::Vector3d::Zero();
  /// [m] The last bias of the barometer, if there is one, and its sigma.
  std::optional<double> barometer_bias;
  double barometer_bias_sigma = 0.0;
  LinearSystem system;  ///< at the solution, without its blocks
  int iterations = 0;   ///< of the solver, all placements together
  int placements = 0;   ///< how often the nodes were placed
  SolverTermination termination = SolverTermination::kIterationLimit;
  bool converged() const { return isConverged(termination); }
};

/// The graph of FixedLagSmoother over all the data at once, with the same factors and nothing marginalised.
/// Each scan has its own t_O, as in the paper (eq. 8-10), so that the offset may drift over the run. Each
/// block of biases holds for SmootherOptions::window seconds, and a random walk links it to the next. The
/// bias of a barometer walks from mean to mean; the frame of a vehicle is one block for the whole run. The
/// solver stops when the next step is shorter than a hundredth of a standard deviation in every direction.
/// The solution counts as converged if that step moves no block by more than a tenth of its standard
/// deviation. With the imu model a node is at the time of measurement of its scan. If the offset moves, the
/// nodes are placed again (docs/method.md, section 10).
class BatchSmoother {
 public:
  /// `imu` must outlive the smoother. It must cover all scans, with max_time_offset to either side if
  /// possible. `g_W` is gravity in W [m/s^2].
  BatchSmoother(const SmootherOptions& options, const BatchOptions& batch, const ImuNoise& noise,
                const Eigen::Vector3d& g_W, const ImuBuffer& imu);

  /// Throws std::invalid_argument without a guess, std::runtime_error if the data do not determine a state.
  BatchSolution solve(const BatchProblem& problem) const;

 private:
  bool atMeasurement() const { return options_.time_offset_model == TimeOffsetModel::kImu; }
  /// The whole run as one window.
  struct Graph {
    Window window;
    struct Node {
      Block* motion = nullptr;
      Block* biases = nullptr;
      bool rests = false, moves_as_vehicle = false;  ///< whether the node has these terms
    };
    std::vector<Node> nodes;
    std::vector<NodeEstimate> states() const;
    struct Scan {
      std::size_t node = 0;
      Block* offset = nullptr;
      Block* extrinsics = nullptr;
      std::shared_ptr<SlowMotion> slow;  ///< null if the mounting is not estimated
    };
    std::vector<Scan> scans;
    std::vector<Block*> extrinsics;   ///< by radar
    Block* vehicle = nullptr;         ///< its frame, if there is one
    Block* barometer_bias = nullptr;  ///< the newest, if there is one
    struct Clock {
      Block* offset = nullptr;  ///< the newest
      bool stepped = false;     ///< t_O may have stepped since then
    };
    std::vector<Clock> clocks;  ///< by radar; if the offset is shared, all use the first
  };
  /// The solver starts from the nodes and extrinsics of `guess`, and the factors are linear in the mounting
  /// from there.
  Graph place(const BatchProblem& problem, const std::vector<double>& t_O, const BatchSolution& guess) const;
  /// Adds the first node, the calibration of each radar and their priors.
  void start(const BatchProblem& problem, const StateBlock& x, const std::vector<Extrinsics>& mounting,
             Graph& graph) const;
  /// Adds a node after the last, and the IMU between them.
  void addNode(Time time, const StateBlock& x, Graph& graph) const;
  /// Returns the offset of a scan at the last node. Adds one if the newest belongs to an earlier node.
  Block* offsetOf(const BatchProblem& problem, const BatchScan& scan, double t_O, Graph& graph) const;
  /// Adds the terms of a scan: of its points or its velocity, and of rest.
  void addTerms(const BatchScan& scan, const Graph::Scan& at, double t_O, Graph& graph) const;
  /// Adds the frame of the vehicle and its level start at the first node.
  void addVehicle(const BatchVehicle& vehicle, Graph& graph) const;
  /// Constrains the last node to the motion of a vehicle.
  void constrain(const BatchVehicle& vehicle, Graph& graph) const;
  /// Adds the barometric heights, each to its nearest node.
  static void addHeights(const BatchProblem& problem, Graph& graph);
  Block& addOffset(Window& window, Time time, double t_O) const;
  /// Biases that hold from `since` on. The time of the block is their end, `window` later.
  Block& addBiases(Window& window, Time since, const StateBlock& x) const;
  /// Whether each mounting is within a standard deviation of where its factors are linear. A smaller turn is
  /// noise, which would add up if the nodes were placed again for it.
  static bool mountingsHold(const Graph& graph, const Solution& solved,
                            const std::vector<Extrinsics>& linear_from);
  /// Sets nodes, scans and extrinsics of the solution, without covariances.
  static void read(const Graph& graph, BatchSolution& solution);
  static void readCovariances(const Graph& graph, const Solution& solved,
                              const std::vector<std::map<int, Eigen::MatrixXd>>& P, BatchSolution& solution);
  RadarMotionModel model() const;

  SmootherOptions options_;  // all read-only after construction
  BatchOptions batch_;
  ImuNoise noise_;
  Eigen::Vector3d g_W_;
  const ImuBuffer* imu_;
  std::shared_ptr<const Manifold> motion_manifold_, bias_manifold_, offset_manifold_, extrinsics_manifold_;
  std::shared_ptr<ceres::LossFunction> loss_;  // of velocities; the points have their own
};

}  // namespace rio_t
