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

/// In snake case, as in `solver_terminations` of summary.yaml.
std::string toString(SolverTermination termination);

/// Which algorithm minimises the cost of a window. The cost functions are the same.
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
  LinearSystem system;      ///< at the solution, or one short step before it
  Elimination elimination;  ///< of `system`
};

/// Moves the blocks to the minimum of the cost. Holds a block that would cross its bound at the bound. Throws
/// std::runtime_error if the terms do not determine the blocks.
///
/// kChain: Gauss-Newton from the current values. If a step does not lower the cost, the solver tries a half
/// of it and less. It has converged when the step is short; it still takes that step. It has also converged
/// when the cost after a whole step is close to the prediction of the linear system (docs/method.md, eq.
/// 23c). kCeres: ceres::Solve on the problem of the window. Ceres also reports convergence if its trust
/// region made a step short. So the Gauss-Newton step at its solution decides the reported termination.
Solution solve(Window& window, const SolverLimits& limits, WindowSolver solver = WindowSolver::kChain);

/// The linear system at the current values and its elimination. Moves no block.
Solution linearized(const Window& window);

}  // namespace rio_t
