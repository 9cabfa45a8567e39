#pragma once

#include <string>

#include "rio_t/graph/elimination.h"
#include "rio_t/graph/window.h"

namespace rio_t {

/// Why the solver of a window stopped.
enum class SolverTermination {
  kConverged,       ///< the Gauss-Newton step is short (docs/method.md, eq. 23a)
  kAtBound,         ///< the same, with a t_O held at its bound max_time_offset
  kIterationLimit,  ///< the solver reached `max_iterations` first
  kNoDecrease,      ///< the step is long, and no shorter step lowers the cost
};

/// The solver found the minimum, or the minimum within the bound.
inline bool isConverged(SolverTermination termination) {
  return termination == SolverTermination::kConverged || termination == SolverTermination::kAtBound;
}

/// In snake case; keys of `solver_terminations`.
std::string toString(SolverTermination termination);

/// Both minimise the same window with the same cost functions.
enum class WindowSolver {
  kChain,  ///< Gauss-Newton with the block elimination of elimination.h
  kCeres,  ///< ceres::Solve, several times slower
};

/// When to stop.
struct SolverLimits {
  int max_iterations = 30;
  /// A step is the last one if its squared length [sigma^2] is below this (docs/method.md, eq. 23a).
  double short_step = 1e-2;
};

struct Solution {
  int iterations = 0;
  SolverTermination termination = SolverTermination::kIterationLimit;
  bool converged() const { return isConverged(termination); }
  LinearSystem system;      ///< at the solution, or one step before it over which it holds
  Elimination elimination;  ///< of it
};

/// Moves the blocks to the minimum of the cost. Holds a block that would cross its bound at the bound. Throws
/// std::runtime_error if the terms do not determine the blocks.
///
/// kChain: Gauss-Newton from the current values. If a step does not lower the cost, the solver tries a half
/// of it and less. It has converged when the step is short; it still takes that step. It has also converged
/// when the cost after a whole step is near enough to what the linear system promised (docs/method.md,
/// eq. 23c).
/// kCeres: ceres::Solve on the problem that lives as long as the window. Ceres also reports convergence when
/// its trust region made a step short. So the step of Gauss-Newton at its solution decides why it ended.
Solution solve(Window& window, const SolverLimits& limits, WindowSolver solver = WindowSolver::kChain);

/// The same without moving any block: no iterations.
Solution linearized(const Window& window);

}  // namespace rio_t
