#include "rio_t/graph/solver.h"

#include <ceres/iteration_callback.h>
#include <ceres/solver.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace rio_t {
namespace {

/// With this radius of the trust region a step is that of Gauss-Newton. A window that starts near its
/// solution begins so: with the default radius the weakly observable directions (offset, biases) take a dozen
/// iterations instead of two or three.
constexpr double kGaussNewtonRadius = 1e12;

bool isBeyondBound(const Block& block) {
  return !block.is_constant && std::isfinite(block.bound) && std::abs(block.x[0]) > block.bound;
}

/// Stops Ceres after a short step, and where a block is beyond its bound: there the factors say nothing new.
class StopEarly final : public ceres::IterationCallback {
 public:
  StopEarly(const Window& window, double short_step) : window_(window), short_step_(short_step) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    const auto& blocks = window_.blocks();
    const bool beyond = std::any_of(blocks.begin(), blocks.end(), [](const auto& b) { return isBeyondBound(*b); });
    // A step of Gauss-Newton lowers the cost by half of its squared length.
    const bool is_short = summary.iteration > 0 && summary.step_is_successful &&
                          2.0 * summary.cost_change < short_step_;
    return beyond || is_short ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  const Window& window_;
  double short_step_;
};

/// The blocks that stand at their bound, with the cost falling outwards.
std::vector<int> pushedOutwards(const Window& window, const NormalEquations& system) {
  std::vector<int> result;
  for (std::size_t i = 0; i < system.blocks.size(); ++i) {
    const Block& block = *window.blocks()[i];
    if (std::isfinite(block.bound) && std::abs(block.x[0]) >= block.bound &&
        system.gradient[i][0] * block.x[0] < 0.0)
      result.push_back(static_cast<int>(i));
  }
  return result;
}

Elimination eliminationOf(const NormalEquations& system) {
  std::optional<Elimination> elimination = Elimination::of(system);
  if (!elimination) throw std::runtime_error("graph: the data do not determine every state");
  return std::move(*elimination);
}

/// Length of the undamped step given that some blocks are held.
double squaredLength(const Solution& solution, const std::vector<int>& held) {
  if (held.empty()) return solution.elimination.squaredLength();
  NormalEquations reduced = solution.normal_equations;
  for (const int i : held) reduced.hold(i);
  return eliminationOf(reduced).squaredLength();
}

ceres::Solver::Options solverOptions() {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.initial_trust_region_radius = kGaussNewtonRadius;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.update_state_every_iteration = true;  // for StopEarly
  // It is StopEarly that ends a solve; these only end what gets nowhere.
  options.function_tolerance = 1e-12;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-14;
  return options;
}

}  // namespace

Solution linearized(const Window& window) {
  Solution solution;
  solution.normal_equations = linearize(window);
  solution.elimination = eliminationOf(solution.normal_equations);
  return solution;
}

Solution solve(Window& window, const SolverLimits& limits) {
  ceres::Solver::Options options = solverOptions();
  StopEarly stop_early(window, limits.short_step);
  options.callbacks = {&stop_early};
  std::vector<int> held;
  const auto setHeld = [&](const std::vector<int>& indices) {
    for (const int i : held) window.setConstant(*window.blocks()[i], false);
    held = indices;
    for (const int i : held) window.setConstant(*window.blocks()[i], true);
  };
  int iterations = 0;
  for (;;) {
    options.max_num_iterations = limits.max_iterations - iterations;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &window.problem(), &summary);
    iterations += std::max(1, static_cast<int>(summary.iterations.size()) - 1);
    for (const auto& block : window.blocks())
      if (isBeyondBound(*block)) block->x[0] = std::copysign(block->bound, block->x[0]);
    const std::vector<int> held_before = held;
    setHeld({});
    Solution solution = linearized(window);
    solution.iterations = iterations;
    const std::vector<int> outwards = pushedOutwards(window, solution.normal_equations);
    const bool is_short = squaredLength(solution, outwards) < limits.short_step;
    if (is_short) {
      solution.termination = outwards.empty() ? SolverTermination::kConverged : SolverTermination::kAtBound;
      return solution;
    }
    if (iterations >= limits.max_iterations) return solution;
    const bool moved = summary.final_cost < summary.initial_cost;
    if (!moved && outwards == held_before) {
      solution.termination = SolverTermination::kNoDecrease;
      return solution;
    }
    setHeld(outwards);
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
