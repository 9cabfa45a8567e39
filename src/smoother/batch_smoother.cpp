#include "rio_t/smoother/batch_smoother.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "rio_t/factors/offset_derivative.h"
#include "rio_t/imu/preintegration.h"
#include "rio_t/smoother/chain_marginals.h"
#include "rio_t/smoother/factor_pool.h"
#include "rio_t/smoother/window_solver.h"

namespace rio_t {
namespace {

/// Scans of the imu model nearer than this share one node [s]: an IMU factor over no time would weigh
/// infinitely.
constexpr double kMinNodeSpacing = 0.005;
/// Squared length of the step that is left, in standard deviations, below which the solution stands.
constexpr double kConverged = 1e-6;

}  // namespace

std::size_t nearestNode(const std::vector<NodeEstimate>& nodes, Time time) {
  const auto after = std::lower_bound(nodes.begin(), nodes.end(), time,
                                      [](const NodeEstimate& node, Time t) { return node.time < t; });
  const auto k = static_cast<std::size_t>(after - nodes.begin());
  if (k == 0) return k;
  return after == nodes.end() || time - nodes[k - 1].time < after->time - time ? k - 1 : k;
}

StateBlock carried(const StateBlock& x, Time from, Time to, const ImuBuffer& imu,
                   const Eigen::Vector3d& g_W) {
  Preintegration pre;
  pre.b_g = x.b_g();
  pre.b_a = x.b_a();
  imu.forEachInterval(from, to, [&](double dt, const Eigen::Vector3d& gyro, const Eigen::Vector3d& accel) {
    pre.delta.step(dt, gyro - pre.b_g, accel - pre.b_a);
  });
  return predict(x, pre, g_W);
}

BatchSmoother::BatchSmoother(const SmootherOptions& options, const BatchOptions& batch, const ImuNoise& noise,
                             const Eigen::Vector3d& g_W, const ImuBuffer& imu)
    : options_(options), batch_(batch), noise_(noise), g_W_(g_W), imu_(&imu) {}

BatchSmoother::Graph BatchSmoother::place(const BatchProblem& problem, const std::vector<double>& t_O,
                                          const std::vector<NodeEstimate>& guess) const {
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
    const NodeEstimate& near = guess[nearestNode(guess, time)];
    return carried(near.x, near.time, time, *imu_, g_W_);
  };

  FactorPool pool(options_, noise_, g_W_, *imu_);
  Graph graph;
  graph.node_of_scan.resize(scans);
  Window& window = graph.window;
  window.prior = std::make_unique<PriorFactor>(problem.prior);
  if (options_.huber_threshold > 0.0)
    window.loss = std::make_unique<ceres::HuberLoss>(options_.huber_threshold);
  window.offset_known = !options_.estimate_time_offset;
  window.max_time_offset = options_.max_time_offset;
  window.nodes.emplace_back();
  window.nodes.back().time = problem.start;
  window.nodes.back().x = stateAt(problem.start);
  window.nodes.back().t_O = window.offset_known || scans == 0 ? problem.prior.t_O0 : t_O[order.front()];
  for (const std::size_t i : order) {
    const BatchScan& scan = problem.scans[i];
    const WindowNode& previous = window.nodes.back();
    const double dt = times[i] - previous.time;
    if (dt > (atMeasurement() ? kMinNodeSpacing : 0.0)) {
      WindowNode node;
      node.time = times[i];
      node.x = stateAt(node.time);
      node.t_O = t_O[i];
      node.imu_from_previous = pool.imuFactor(
          preintegrate(*imu_, previous.time, node.time, previous.x.b_g(), previous.x.b_a(), noise_));
      node.offset_from_previous = pool.offsetFactor(
          scan.offset_stepped ? options_.time_offset_sigma : options_.time_offset_noise * std::sqrt(dt));
      window.nodes.push_back(std::move(node));
    }
    WindowNode& node = window.nodes.back();
    graph.node_of_scan[i] = window.nodes.size() - 1;
    if (scan.velocity) node.radar.push_back({scan.stamp, pool.radarFactor(*scan.velocity, node.time)});
    if (scan.rest_velocity_sigma) node.rest = pool.zeroVelocityFactor(*scan.rest_velocity_sigma);
  }
  return graph;
}

BatchSolution BatchSmoother::solve(const BatchProblem& problem) const {
  if (problem.guess.empty()) throw std::invalid_argument("batch: no state to begin from");
  std::vector<double> t_O;
  for (const BatchScan& scan : problem.scans) t_O.push_back(scan.t_O);

  BatchSolution solution;
  WindowStep step;
  Graph graph = place(problem, t_O, problem.guess);
  solution.placements = 1;
  for (;;) {
    SolverLimits limits;
    limits.max_iterations = batch_.max_iterations;
    const SolveReport report = solveWithCeres(graph.window, limits);
    solution.iterations += report.iterations;
    // Ceres does not take the step at which it stops; the chain takes those that are left.
    for (;; ++solution.iterations) {
      linearize(graph.window, &solution.normal_equations);
      if (!step.solve(graph.window, solution.normal_equations, 0.0))
        throw std::runtime_error("batch: the data do not determine every state");
      if (step.length() < kConverged || step.length() > 1.0 || solution.iterations >= batch_.max_iterations)
        break;
      step.take(1.0, graph.window);
    }

    solution.nodes.clear();
    for (const WindowNode& node : graph.window.nodes) solution.nodes.push_back({node.time, node.x, node.t_O});
    double moved = 0.0;  // [s]
    for (std::size_t i = 0; i < t_O.size(); ++i)
      moved = std::max(moved, std::abs(solution.nodes[graph.node_of_scan[i]].t_O - t_O[i]));
    const bool placed = !atMeasurement() || moved <= batch_.placement_tolerance;
    if (placed && step.length() < kConverged) {
      solution.termination = step.atBound() ? SolverTermination::kAtBound : SolverTermination::kConverged;
      break;
    }
    if (solution.iterations >= batch_.max_iterations) {
      if (!report.converged()) solution.termination = report.termination;
      break;
    }
    if (placed) continue;
    for (std::size_t i = 0; i < t_O.size(); ++i) t_O[i] = solution.nodes[graph.node_of_scan[i]].t_O;
    graph = place(problem, t_O, solution.nodes);
    ++solution.placements;
  }
  solution.node_of_scan = std::move(graph.node_of_scan);
  solution.covariances = marginalCovariances(solution.normal_equations);
  return solution;
}

BatchSmoother::Residual BatchSmoother::residual(const NodeEstimate& node, const NodeMatrix& covariance,
                                                const RadarVelocityMeasurement& z) const {
  RadarVelocityMeasurement unit = z;
  unit.covariance.setIdentity();
  unit.held_t_O.reset();
  // The paper's factor stands at the stamp itself.
  const StateBlock x = atMeasurement() ? node.x : carried(node.x, node.time, z.stamp, *imu_, g_W_);
  const double* blocks[] = {x.data(), &node.t_O};
  StateJacobian<3> J_x;
  Residual result;
  Eigen::Vector3d J_t;
  double* jacobians[] = {J_x.data(), J_t.data()};
  FactorPool(options_, noise_, g_W_, *imu_)
      .radarFactor(unit, node.time)
      ->Evaluate(blocks, result.value.data(), jacobians);
  Eigen::Matrix<double, 3, kNodeTangent> J;
  J << J_x.leftCols<3>(), J_x.rightCols<StateBlock::kTangent - 3>(), J_t;
  if (!options_.estimate_time_offset) J.rightCols<1>().setZero();
  result.prediction_covariance = J * covariance * J.transpose();
  const Time tau = z.stamp - node.t_O;
  result.informs_offset = velocityRate(*imu_, tau, carried(node.x, node.time, tau, *imu_, g_W_), g_W_, z.l_I)
                              .informsOffset(options_.time_offset_min_acceleration);
  return result;
}

}  // namespace rio_t
