#include "rio_t/smoother/batch_smoother.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "rio_t/factors/constant_offset_factor.h"
#include "rio_t/factors/imu_factor.h"
#include "rio_t/factors/zero_velocity_factor.h"
#include "rio_t/graph/marginalization.h"
#include "rio_t/imu/preintegration.h"

namespace rio_t {
namespace {

/// Squared length of the step that is left, in standard deviations, below which the solution stands.
constexpr double kConverged = 1e-6;

/// Of each node's state and t_O, which follow each other in the elimination.
std::vector<NodeMatrix> nodeCovariances(const Elimination& elimination) {
  const std::vector<std::map<int, Eigen::MatrixXd>> P = elimination.covariances();
  std::vector<NodeMatrix> result;
  for (int i = 0; i < static_cast<int>(P.size()); i += 2) {
    const auto found = P[i].find(i + 1);  // none where the offset is known
    const Eigen::MatrixXd cross =
        found == P[i].end() ? Eigen::MatrixXd(NodeVector::Zero().head<15>()) : found->second;
    NodeMatrix covariance;
    covariance << P[i].at(i), cross, cross.transpose(), P[i + 1].at(i + 1);
    result.push_back(covariance);
  }
  return result;
}

}  // namespace

std::size_t nearestNode(const std::vector<BatchNode>& nodes, Time time) {
  const auto after = std::lower_bound(nodes.begin(), nodes.end(), time,
                                      [](const BatchNode& node, Time t) { return node.time < t; });
  const auto k = static_cast<std::size_t>(after - nodes.begin());
  if (k == 0) return k;
  return after == nodes.end() || time - nodes[k - 1].time < after->time - time ? k - 1 : k;
}

BatchSmoother::BatchSmoother(const SmootherOptions& options, const BatchOptions& batch, const ImuNoise& noise,
                             const Eigen::Vector3d& g_W, const ImuBuffer& imu)
    : options_(options),
      batch_(batch),
      noise_(noise),
      g_W_(g_W),
      imu_(&imu),
      state_manifold_(std::make_shared<StateManifold>()),
      offset_manifold_(std::make_shared<ScalarManifold>()) {}

BatchSmoother::Graph BatchSmoother::place(const BatchProblem& problem, const std::vector<double>& t_O,
                                          const std::vector<BatchNode>& guess) const {
  const std::size_t scans = problem.scans.size();
  std::vector<Time> times(scans);
  for (std::size_t i = 0; i < scans; ++i) {
    const Time time = atMeasurement() ? problem.scans[i].stamp - t_O[i] : problem.scans[i].stamp;
    times[i] = std::clamp(time, problem.start, std::max(problem.start, imu_->newest()));
  }
  std::vector<std::size_t> order(scans);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return times[a] < times[b]; });
  const auto stateAt = [&](Time time) {
    const BatchNode& near = guess[nearestNode(guess, time)];
    return carried(near.x, near.time, time, *imu_, g_W_);
  };

  const std::shared_ptr<ceres::LossFunction> loss = huberLoss(options_.huber_threshold);
  Graph graph;
  graph.node_of_scan.resize(scans);
  Window& window = graph.window;
  const double first_t_O =
      !options_.estimate_time_offset || scans == 0 ? problem.prior.t_O0 : t_O[order.front()];
  graph.nodes.push_back(addNode(window, {problem.start, problem.prior.x0, problem.prior.t_O0}));
  addPrior(window, {graph.nodes[0].state, graph.nodes[0].offset}, {problem.prior.J, problem.prior.r0});
  graph.nodes[0].state->x = stored(stateAt(problem.start));
  graph.nodes[0].offset->x[0] = first_t_O;
  for (const std::size_t i : order) {
    const BatchScan& scan = problem.scans[i];
    const Node previous = graph.nodes.back();
    const Time previous_time = *previous.state->time;
    const double dt = times[i] - previous_time;
    if (dt > (atMeasurement() ? kMinNodeSpacing : 0.0)) {
      const Node node = addNode(window, {times[i], stateAt(times[i]), t_O[i]});
      const StateView x(previous.state->x.data());
      window.add(std::make_unique<ImuFactor>(
                     preintegrate(*imu_, previous_time, times[i], x.b_g, x.b_a, noise_), noise_, g_W_),
                 {previous.state, node.state});
      window.add(std::make_unique<ConstantOffsetFactor>(scan.offset_stepped
                                                            ? options_.time_offset_sigma
                                                            : options_.time_offset_noise * std::sqrt(dt)),
                 {previous.offset, node.offset});
      graph.nodes.push_back(node);
    }
    const Node& node = graph.nodes.back();
    graph.node_of_scan[i] = graph.nodes.size() - 1;
    // Placed anew where the offset moves, so first order is enough.
    const auto placed = [&](auto z) {
      if (atMeasurement() || z.offset_gain == 0.0) z.linear_from_t_O = t_O[i];
      return z;
    };
    if (scan.doppler) {
      window.add(std::make_unique<DopplerFactor>(placed(*scan.doppler), *node.state->time, model()),
                 {node.state, node.offset});
    } else if (scan.velocity) {
      window.add(std::make_unique<RadarVelocityFactor>(placed(*scan.velocity), *node.state->time, model()),
                 {node.state, node.offset}, loss);
    }
    if (scan.rest_velocity_sigma)
      window.add(std::make_unique<ZeroVelocityFactor>(*scan.rest_velocity_sigma), {node.state});
  }
  return graph;
}

BatchSmoother::Node BatchSmoother::addNode(Window& window, const BatchNode& node) const {
  Block& state = window.addNode(node.time, state_manifold_, stored(node.x));
  Block& offset = window.addNode(node.time, offset_manifold_, Eigen::VectorXd::Constant(1, node.t_O));
  offset.bound = options_.max_time_offset;
  if (!options_.estimate_time_offset) window.setConstant(offset, true);
  return {&state, &offset};
}

RadarMotionModel BatchSmoother::model() const {
  return {options_.time_offset_model, options_.max_time_offset, g_W_, imu_};
}

BatchSolution BatchSmoother::solve(const BatchProblem& problem) const {
  if (problem.guess.empty()) throw std::invalid_argument("batch: no state to begin from");
  std::vector<double> t_O;
  for (const BatchScan& scan : problem.scans) t_O.push_back(scan.t_O);

  BatchSolution solution;
  Graph graph = place(problem, t_O, problem.guess);
  solution.placements = 1;
  for (;;) {
    Solution solved = rio_t::solve(graph.window, {batch_.max_iterations - solution.iterations, kConverged},
                                   options_.solver);
    solution.iterations += solved.iterations;
    solution.nodes.clear();
    for (const Node& node : graph.nodes) solution.nodes.push_back(node.estimate());
    double moved = 0.0;  // [s]
    for (std::size_t i = 0; i < t_O.size(); ++i)
      moved = std::max(moved, std::abs(solution.nodes[graph.node_of_scan[i]].t_O - t_O[i]));
    const bool placed = !atMeasurement() || moved <= batch_.placement_tolerance;
    const bool is_last = placed || solution.iterations >= batch_.max_iterations;
    if (is_last) {
      solution.termination =
          placed || !solved.converged() ? solved.termination : SolverTermination::kIterationLimit;
      solution.covariances = nodeCovariances(solved.elimination);
      solution.normal_equations = std::move(solved.normal_equations);
      break;
    }
    for (std::size_t i = 0; i < t_O.size(); ++i) t_O[i] = solution.nodes[graph.node_of_scan[i]].t_O;
    graph = place(problem, t_O, solution.nodes);
    ++solution.placements;
  }
  solution.node_of_scan = std::move(graph.node_of_scan);
  return solution;
}

BatchSmoother::Residual BatchSmoother::residual(const BatchNode& node, const NodeMatrix& covariance,
                                                const RadarVelocityMeasurement& z) const {
  RadarVelocityMeasurement unit = z;
  unit.covariance.setIdentity();
  unit.linear_from_t_O.reset();
  unit.offset_gain = 1.0;
  // The paper's factor stands at the stamp itself.
  const StateBlock x = atMeasurement() ? node.x : carried(node.x, node.time, z.stamp, *imu_, g_W_);
  const double* blocks[] = {x.data(), &node.t_O};
  StateJacobian<3> J_x;
  Residual result;
  Eigen::Vector3d J_t;
  double* jacobians[] = {J_x.data(), J_t.data()};
  RadarVelocityFactor(unit, node.time, model()).Evaluate(blocks, result.value.data(), jacobians);
  Eigen::Matrix<double, 3, kNodeTangent> J;
  J << J_x.leftCols<3>(), J_x.rightCols<StateBlock::kTangent - 3>(), J_t;
  if (!options_.estimate_time_offset) J.rightCols<1>().setZero();
  result.prediction_covariance = J * covariance * J.transpose();
  return result;
}

}  // namespace rio_t
