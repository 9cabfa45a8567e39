#include "rio_t/smoother/window_solver.h"

#include <ceres/problem.h>
#include <ceres/solver.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>

#include "rio_t/factors/state_manifold.h"

namespace rio_t {
namespace {

/// A t_O that is nearer to its bound stands at it [s].
constexpr double kAtBound = 1e-9;
/// Of the active set to settle. Each pass moves whole runs of nodes: a few do.
constexpr int kMaxPasses = 10;
/// Of a step that is tried where the whole one raises the cost. A tilt that is lost makes steps of a radian,
/// over which the graph is not linear but the direction is right; damping would shorten them to a hundredth.
constexpr double kShortestShare = 0.06;
constexpr double kFirstDamping = 1e-4;
constexpr int kOffset = StateBlock::kTangent;

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

/// Beyond the bound the radar factors say nothing new.
class StopBeyondBound final : public ceres::IterationCallback {
 public:
  explicit StopBeyondBound(const Window& window) : window_(window) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& /*summary*/) override {
    const auto beyond = [&](const WindowNode& node) {
      return std::abs(node.t_O) > window_.max_time_offset + kAtBound;
    };
    const bool any = std::any_of(window_.nodes.begin(), window_.nodes.end(), beyond);
    return any && !window_.offset_known ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  const Window& window_;
};

/// Moves to their bound, and makes constant, the t_O that `step` holds there, and no others. False: no
/// change.
bool holdAtBound(const WindowStep& step, Window& window, ceres::Problem& problem) {
  bool changed = false;
  for (std::size_t k = 0; k < window.nodes.size(); ++k) {
    double* const t_O = &window.nodes[k].t_O;
    const std::optional<double> bound = step.heldAt(k);
    if (bound.has_value() == problem.IsParameterBlockConstant(t_O)) continue;
    changed = true;
    if (bound) {
      *t_O = *bound;
      problem.SetParameterBlockConstant(t_O);
    } else {
      problem.SetParameterBlockVariable(t_O);
    }
  }
  return changed;
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

void WindowStep::take(double share, Window& window) const {
  for (std::size_t k = 0; k < window.nodes.size(); ++k) {
    WindowNode& node = window.nodes[k];
    const NodeVector delta = share * solution_.delta[k];
    boxplus(node.x.data(), delta.data(), node.x.data());
    if (window.offset_known) continue;
    node.t_O = std::clamp(node.t_O + delta(kOffset), -window.max_time_offset, window.max_time_offset);
  }
}

bool WindowStep::solve(const Window& window, const ChainSystem& system, double damping) {
  holdWherePushedOutwards(window, system);
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    if (!solveWithHeld(window, system, damping)) return false;
    const bool released = at_bound_ && releaseWherePulledInwards(system, damping);
    const bool crossed = !window.offset_known && holdWhereCrossed(window);
    if (!released && !crossed) return true;
  }
  length_ = std::numeric_limits<double>::infinity();
  return true;
}

void WindowStep::holdWherePushedOutwards(const Window& window, const ChainSystem& system) {
  held_.assign(window.nodes.size(), std::nullopt);
  at_bound_ = false;
  if (window.offset_known) return;
  for (std::size_t k = 0; k < held_.size(); ++k) {
    const double t_O = window.nodes[k].t_O;
    if (std::abs(t_O) < window.max_time_offset - kAtBound || t_O * system.gradient[k](kOffset) >= 0.0)
      continue;
    held_[k] = std::copysign(window.max_time_offset, t_O);
    at_bound_ = true;
  }
}

bool WindowStep::solveWithHeld(const Window& window, const ChainSystem& system, double damping) {
  const auto solveChain = [&](const ChainSystem& chain) {
    return damping == 0.0 ? solveUndamped(chain, &solution_) : rio_t::solve(chain, damping, &solution_);
  };
  if (!at_bound_) {
    const bool solved = solveChain(system);
    length_ = solution_.decrease;
    return solved;
  }
  reduced_ = system;
  for (std::size_t k = 0; k < held_.size(); ++k)
    if (held_[k]) reduced_.holdOffset(k, *held_[k] - window.nodes[k].t_O);
  if (!solveChain(reduced_)) return false;
  for (std::size_t k = 0; k < held_.size(); ++k)
    if (held_[k]) solution_.delta[k](kOffset) = *held_[k] - window.nodes[k].t_O;
  return true;
}

bool WindowStep::holdWhereCrossed(const Window& window) {
  bool any = false;
  for (std::size_t k = 0; k < held_.size(); ++k) {
    const double t_O = window.nodes[k].t_O + solution_.delta[k](kOffset);
    if (held_[k] || std::abs(t_O) <= window.max_time_offset + kAtBound) continue;
    held_[k] = std::copysign(window.max_time_offset, t_O);
    at_bound_ = any = true;
  }
  return any;
}

bool WindowStep::releaseWherePulledInwards(const ChainSystem& system, double damping) {
  bool any = false;
  at_bound_ = false;
  length_ = 0.0;
  for (std::size_t k = 0; k < held_.size(); ++k) {
    const NodeVector& delta = solution_.delta[k];
    const NodeMatrix& H = system.diagonal[k];
    NodeVector image = H * delta + damping * H.diagonal().cwiseProduct(delta);
    if (k > 0) image += system.coupling[k - 1].transpose() * solution_.delta[k - 1];
    if (k + 1 < held_.size()) image += system.coupling[k] * solution_.delta[k + 1];
    length_ += delta.dot(image);
    if (held_[k] && *held_[k] * (system.gradient[k](kOffset) + image(kOffset)) > 0.0) {
      held_[k].reset();
      any = true;
    }
    at_bound_ = at_bound_ || held_[k];
  }
  return any;
}

SolveReport WindowSolver::solve(Window& window, const SolverLimits& limits) {
  SolveReport report;
  double damping = 0.0;
  bool tested = false;        // the undamped step at these nodes is long
  bool is_of_system = false;  // step_, without damping and with nothing held
  linearize(window, &system_);
  for (report.iterations = 1;; ++report.iterations) {
    const bool solved = step_.solve(window, system_, damping);
    const bool is_short = solved && step_.length() < limits.short_step;
    is_of_system = solved && damping == 0.0 && !step_.atBound();
    if (is_short && damping == 0.0) {
      step_.take(1.0, window);
      report.termination = step_.atBound() ? SolverTermination::kAtBound : SolverTermination::kConverged;
      break;
    }
    if (report.iterations >= limits.max_iterations) break;
    if (damping == 0.0) tested = true;
    if (is_short && !tested) {
      damping = 0.0;  // short by the damping, or because little is left to go
    } else if (solved && stepLowersCost(window)) {
      is_of_system = tested = false;
      damping = damping > kFirstDamping ? 0.1 * damping : 0.0;
    } else if (is_short) {
      report.termination = SolverTermination::kNoDecrease;
      break;
    } else {
      damping = std::max(kFirstDamping, 10.0 * damping);
    }
  }
  covariance_ = is_of_system ? NodeMatrix(step_.solution().newest.solve(NodeMatrix::Identity()))
                             : covarianceOfLast(system_, &step_.solution());
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
    step_.take(share, window);
    linearize(window, &candidate_);
    if (candidate_.cost < system_.cost) {
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

SolveReport solveWithCeres(Window& window, const SolverLimits& limits) {
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
  options.max_num_iterations = limits.max_iterations;
  // Those of Ceres with the short_step that is the default.
  options.function_tolerance = 1e-4 * limits.short_step;
  options.gradient_tolerance = 1e-8 * limits.short_step;
  options.parameter_tolerance = 1e-6 * limits.short_step;
  options.num_threads = 1;
  // Warm-started problems are near their solution: begin as Gauss-Newton. With the default radius the weakly
  // observable directions (offset, biases) take a dozen iterations instead of two or three.
  options.initial_trust_region_radius = 1e12;
  options.logging_type = ceres::SILENT;
  StopBeyondBound stop_beyond_bound(window);
  options.callbacks = {&stop_beyond_bound};
  options.update_state_every_iteration = true;

  SolveReport report;
  ChainSystem system;
  WindowStep step;
  for (;;) {
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    report.iterations += static_cast<int>(summary.iterations.size());
    for (WindowNode& node : nodes)
      node.t_O = std::clamp(node.t_O, -window.max_time_offset, window.max_time_offset);
    linearize(window, &system);
    const bool solved = step.solve(window, system, 0.0);
    if (solved && step.length() < limits.short_step) {
      report.termination = step.atBound() ? SolverTermination::kAtBound : SolverTermination::kConverged;
      return report;
    }
    options.max_num_iterations = limits.max_iterations - report.iterations;
    if (options.max_num_iterations <= 0 || summary.termination_type == ceres::NO_CONVERGENCE) return report;
    const bool held_others = !window.offset_known && holdAtBound(step, window, problem);
    if (!held_others && summary.termination_type != ceres::USER_SUCCESS) {
      report.termination = SolverTermination::kNoDecrease;
      return report;
    }
  }
}

std::string toString(SolverTermination termination) {
  switch (termination) {
    case SolverTermination::kConverged:
      return "converged";
    case SolverTermination::kAtBound:
      return "at_bound";
    case SolverTermination::kIterationLimit:
      return "iteration_limit";
    case SolverTermination::kNoDecrease:
      return "no_decrease";
  }
  return "";
}

}  // namespace rio_t
