#include "rio_t/smoother/window_solver.h"

#include <ceres/problem.h>
#include <ceres/solver.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "rio_t/factors/state_manifold.h"

namespace rio_t {
namespace {

/// Squared length of a step in standard deviations, below which it is the last one (eq. 23a).
constexpr double kConverged = 1e-2;
/// Of a step that is tried where the whole one raises the cost. A tilt that is lost makes steps of a radian,
/// over which the graph is not linear but the direction is right; damping would shorten them to a hundredth.
constexpr double kShortestShare = 0.06;
constexpr double kFirstDamping = 1e-4;

ceres::Problem::Options borrowingProblem() {
  ceres::Problem::Options options;
  options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
#if RIO_T_CERES_HAS_MANIFOLD
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
#else
  options.local_parameterization_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
#endif
  options.disable_all_safety_checks = true;
  return options;
}

void takeStep(const ChainSolution& solution, double share, Window& window) {
  for (std::size_t k = 0; k < window.nodes.size(); ++k) {
    WindowNode& node = window.nodes[k];
    const NodeVector delta = share * solution.delta[k];
    boxplus(node.x.data(), delta.data(), node.x.data());
    if (window.offset_known) continue;
    node.t_O =
        std::clamp(node.t_O + delta(StateBlock::kTangent), -window.max_time_offset, window.max_time_offset);
  }
}

}  // namespace

void linearize(const Window& window, ChainSystem* system) {
  const auto& nodes = window.nodes;
  system->reset(nodes.size());
  system->addStateAndOffset(0, *window.prior, nodes[0].x.data(), &nodes[0].t_O, nullptr, false);
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const WindowNode& node = nodes[k];
    for (const RadarTerm& term : node.radar) {
      system->addStateAndOffset(k, *term.cost, node.x.data(), &node.t_O, window.loss.get(),
                                window.offset_known);
    }
    if (node.rest) system->addState(k, *node.rest, node.x.data());
    if (k == 0) continue;
    system->addStatePair(k - 1, *node.imu_from_previous, nodes[k - 1].x.data(), node.x.data());
    system->addOffsetPair(k - 1, *node.offset_from_previous, &nodes[k - 1].t_O, &node.t_O);
  }
}

SolveReport WindowSolver::solve(Window& window, int max_iterations) {
  SolveReport report;
  double damping = 0.0;
  bool is_of_system = false;  // solution_, without damping
  linearize(window, &system_);
  for (report.iterations = 1;; ++report.iterations) {
    const bool solved =
        damping == 0.0 ? solveUndamped(system_, &solution_) : rio_t::solve(system_, damping, &solution_);
    is_of_system = solved && damping == 0.0;
    report.converged = solved && solution_.decrease < kConverged;
    if (report.converged && damping == 0.0) takeStep(solution_, 1.0, window);
    if (report.converged || report.iterations >= max_iterations) break;
    const double cost = system_.cost;
    if (solved && stepLowersCost(window)) {
      is_of_system = false;
      report.converged = cost - system_.cost < 0.5 * kConverged;
      if (report.converged) break;
      damping = damping > kFirstDamping ? 0.1 * damping : 0.0;
    } else {
      damping = std::max(kFirstDamping, 10.0 * damping);
    }
  }
  covariance_ = is_of_system ? NodeMatrix(solution_.newest.solve(NodeMatrix::Identity()))
                             : covarianceOfLast(system_, &solution_);
  return report;
}

bool WindowSolver::stepLowersCost(Window& window) {
  const std::size_t count = window.nodes.size();
  states_before_.resize(count);
  offsets_before_.resize(count);
  for (std::size_t k = 0; k < count; ++k) {
    states_before_[k] = window.nodes[k].x;
    offsets_before_[k] = window.nodes[k].t_O;
  }
  for (double share = 1.0; share > kShortestShare; share *= 0.5) {
    takeStep(solution_, share, window);
    linearize(window, &candidate_);
    if (candidate_.cost <= system_.cost) {
      std::swap(system_, candidate_);
      return true;
    }
    for (std::size_t k = 0; k < count; ++k) {
      window.nodes[k].x = states_before_[k];
      window.nodes[k].t_O = offsets_before_[k];
    }
  }
  return false;
}

NodeMatrix newestCovariance(const Window& window) {
  ChainSystem system;
  ChainSolution solution;
  linearize(window, &system);
  return covarianceOfLast(system, &solution);
}

SolveReport solveWithCeres(Window& window, int max_iterations) {
  StateManifold manifold;
  ceres::Problem problem(borrowingProblem());
  for (WindowNode& node : window.nodes) {
    addStateBlock(problem, node.x.data(), manifold);
    problem.AddParameterBlock(&node.t_O, 1);
    if (window.offset_known) problem.SetParameterBlockConstant(&node.t_O);
  }
  auto& nodes = window.nodes;
  problem.AddResidualBlock(window.prior.get(), nullptr, nodes.front().x.data(), &nodes.front().t_O);
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    WindowNode& node = nodes[k];
    for (const RadarTerm& term : node.radar) {
      problem.AddResidualBlock(term.cost.get(), window.loss.get(), node.x.data(), &node.t_O);
    }
    if (node.rest) problem.AddResidualBlock(node.rest.get(), nullptr, node.x.data());
    if (k == 0) continue;
    problem.AddResidualBlock(node.imu_from_previous.get(), nullptr, nodes[k - 1].x.data(), node.x.data());
    problem.AddResidualBlock(node.offset_from_previous.get(), nullptr, &nodes[k - 1].t_O, &node.t_O);
  }

  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = max_iterations;
  options.num_threads = 1;
  // Warm-started problems are near their solution: begin as Gauss-Newton. With the default radius the weakly
  // observable directions (offset, biases) take a dozen iterations instead of two or three.
  options.initial_trust_region_radius = 1e12;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  for (WindowNode& node : nodes)
    node.t_O = std::clamp(node.t_O, -window.max_time_offset, window.max_time_offset);
  return {static_cast<int>(summary.iterations.size()), summary.termination_type == ceres::CONVERGENCE};
}

}  // namespace rio_t
