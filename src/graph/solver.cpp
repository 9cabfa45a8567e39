#include "rio_t/graph/solver.h"

#include <ceres/iteration_callback.h>
#include <ceres/solver.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <utility>

namespace rio_t {
namespace {

/// With this radius of the trust region, Ceres begins with Gauss-Newton steps. A window starts near its
/// solution. With the default radius, the weakly observable directions (offset, biases) take a dozen
/// iterations instead of two or three.
constexpr double kGaussNewtonRadius = 1e12;

bool isBeyondBound(const Block& block) {
  return !block.is_constant && std::isfinite(block.bound) && std::abs(block.x[0]) > block.bound;
}

/// Stops Ceres after a short step, or if a block is beyond its bound, where the factors do not change.
class StopEarly final : public ceres::IterationCallback {
 public:
  StopEarly(const Window& window, double short_step) : window_(window), short_step_(short_step) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    const auto& blocks = window_.blocks();
    const bool beyond =
        std::any_of(blocks.begin(), blocks.end(), [](const auto& b) { return isBeyondBound(*b); });
    // A step of Gauss-Newton lowers the cost by half of its squared length.
    const bool is_short =
        summary.iteration > 0 && summary.step_is_successful && 2.0 * summary.cost_change < short_step_;
    return beyond || is_short ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  const Window& window_;
  double short_step_;
};

/// Indices of the blocks that are at their bound and whose cost decreases outwards.
std::vector<int> pushedOutwards(const Window& window, const LinearSystem& system) {
  std::vector<int> result;
  for (std::size_t i = 0; i < system.blocks.size(); ++i) {
    const Block& block = *window.blocks()[i];
    if (std::isfinite(block.bound) && std::abs(block.x[0]) >= block.bound &&
        system.gradient(static_cast<int>(i))[0] * block.x[0] < 0.0)
      result.push_back(static_cast<int>(i));
  }
  return result;
}

Elimination eliminationOf(const LinearSystem& system) {
  std::optional<Elimination> elimination = Elimination::of(system);
  if (!elimination) throw std::runtime_error("graph: the data do not determine every state");
  return std::move(*elimination);
}

/// The same if the blocks `held` do not move.
Elimination eliminationOf(LinearSystem system, const std::vector<int>& held) {
  for (const int i : held) system.hold(i);
  return eliminationOf(system);
}

/// Squared length of the undamped step if the blocks `held` do not move.
double squaredLength(const Solution& solution, const std::vector<int>& held) {
  if (held.empty()) return solution.elimination.squaredLength();
  return eliminationOf(solution.system, held).squaredLength();
}

ceres::Solver::Options solverOptions() {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.initial_trust_region_radius = kGaussNewtonRadius;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.update_state_every_iteration = true;  // for StopEarly
  // StopEarly ends a solve. These limits end only one that makes no progress.
  options.function_tolerance = 1e-12;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-14;
  return options;
}

/// The smallest share of a step that is tried if the whole step raises the cost. A lost tilt makes steps of a
/// radian. The graph is not linear over them, but their direction is right. Damping makes them too short.
constexpr double kShortestShare = 0.06;
/// [sigma^2] A step with a smaller squared length is taken without comparing costs: its gain is rounding.
constexpr double kSurelyRight = 1e-2;
/// Squared length [sigma^2] of the longest step after which the solver may stop.
constexpr double kLongestLastStep = 1.0;

/// Moves all blocks by `share` of the step, at most to their bounds. Returns whether a bound stopped one.
bool take(const std::vector<Eigen::VectorXd>& step, double share, Window& window) {
  bool stopped = false;
  for (std::size_t i = 0; i < step.size(); ++i) {
    Block& block = *window.blocks()[i];
    const Eigen::VectorXd delta = share * step[i];
    block.manifold->plus(block.x.data(), delta.data(), block.x.data());
    if (!isBeyondBound(block)) continue;
    block.x[0] = std::copysign(block.bound, block.x[0]);
    stopped = true;
  }
  return stopped;
}

struct TakenStep {
  double cost;    ///< after it
  bool is_whole;  ///< neither a share of the step nor stopped at a bound
};

/// Takes the step, or the first smaller share of it that lowers the cost. None if no share lowers it.
std::optional<TakenStep> lowerCost(const std::vector<Eigen::VectorXd>& step, double cost_before,
                                   Window& window) {
  std::vector<Eigen::VectorXd> before;
  for (const auto& block : window.blocks()) before.emplace_back(block->x);
  for (double share = 1.0; share > kShortestShare; share *= 0.5) {
    const bool stopped_at_bound = take(step, share, window);
    const double cost = costOf(window);
    if (cost < cost_before) return TakenStep{cost, share == 1.0 && !stopped_at_bound};
    for (std::size_t i = 0; i < before.size(); ++i) window.blocks()[i]->x = before[i];
  }
  return std::nullopt;
}

/// Predicts the squared length of the next step. The cost after a whole step is off the linear prediction by
/// `unforeseen`. This difference grows with the cube of the step, so the slope that is left along the step is
/// three times as large. Infinite after a step of more than a sigma: slope across it may be left, too.
double squaredLengthLeft(double unforeseen, double squared_length) {
  if (squared_length > kLongestLastStep) return std::numeric_limits<double>::infinity();
  return 9.0 * unforeseen * unforeseen / squared_length;
}

Solution solveByChain(Window& window, const SolverLimits& limits) {
  Solution solution;
  LinearSystem& system = solution.system;
  double surely_right = kSurelyRight;
  for (int pass = 1;; ++pass) {
    solution.iterations = std::min(pass, limits.max_iterations);
    system = linearize(window);
    const std::vector<int> held = pushedOutwards(window, system);
    solution.elimination = held.empty() ? eliminationOf(system) : eliminationOf(system, held);
    const double squared_length = solution.elimination.squaredLength();
    const bool is_short = squared_length < limits.short_step;
    const bool is_last = pass > limits.max_iterations;  // only judges the last step
    bool has_ended = is_last;
    if (is_short || squared_length < surely_right) {
      surely_right = squared_length;  // the next one must be shorter, or steps may oscillate
      const bool stopped_at_bound = take(solution.elimination.delta(), 1.0, window);
      if (is_short && !stopped_at_bound) {
        solution.termination = held.empty() ? SolverTermination::kConverged : SolverTermination::kAtBound;
        has_ended = true;
      }
    } else if (!is_last) {
      const std::optional<TakenStep> taken = lowerCost(solution.elimination.delta(), system.cost, window);
      if (!taken) {
        solution.termination = SolverTermination::kNoDecrease;
        has_ended = true;
      } else if (held.empty() && taken->is_whole) {
        const double unforeseen = taken->cost - (system.cost - 0.5 * squared_length);
        if (squaredLengthLeft(unforeseen, squared_length) < limits.short_step) {
          solution.termination = SolverTermination::kConverged;
          has_ended = true;
        }
      }
    }
    if (!has_ended) continue;
    if (!held.empty()) solution.elimination = eliminationOf(system);  // the covariance is without the bound
    return solution;
  }
}

Solution solveByCeres(Window& window, const SolverLimits& limits) {
  ceres::Solver::Options options = solverOptions();
  StopEarly stop_early(window, limits.short_step);
  options.callbacks = {&stop_early};
  std::vector<int> held;
  const auto release = [&] {
    for (const int i : held) window.setConstant(*window.blocks()[i], false);
    return std::exchange(held, {});
  };
  int iterations = 0;
  for (;;) {
    options.max_num_iterations = limits.max_iterations - iterations;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &window.problem(), &summary);
    iterations += std::max(1, static_cast<int>(summary.iterations.size()) - 1);
    for (const auto& block : window.blocks())
      if (isBeyondBound(*block)) block->x[0] = std::copysign(block->bound, block->x[0]);
    const std::vector<int> held_before = release();
    Solution solution = linearized(window);
    solution.iterations = iterations;
    const std::vector<int> outwards = pushedOutwards(window, solution.system);
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
    held = outwards;
    for (const int i : held) window.setConstant(*window.blocks()[i], true);
  }
}

}  // namespace

Solution linearized(const Window& window) {
  Solution solution;
  solution.system = linearize(window);
  solution.elimination = eliminationOf(solution.system);
  return solution;
}

Solution solve(Window& window, const SolverLimits& limits, WindowSolver solver) {
  return solver == WindowSolver::kCeres ? solveByCeres(window, limits) : solveByChain(window, limits);
}

std::string toString(SolverTermination termination) {
  constexpr const char* kNames[] = {"converged", "at_bound", "iteration_limit", "no_decrease"};
  static_assert(std::size(kNames) == static_cast<std::size_t>(SolverTermination::kNoDecrease) + 1);
  return kNames[static_cast<std::size_t>(termination)];
}

}  // namespace rio_t
