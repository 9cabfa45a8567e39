#pragma once

#include "rio_t/graph/normal_equations.h"
#include "rio_t/graph/solver_termination.h"
#include "rio_t/graph/window.h"

namespace rio_t {

/// Both minimise the same window with the same cost functions.
enum class WindowSolver {
  kChain,  ///< Gauss-Newton with the elimination of normal_equations.h
  kCeres,  ///< ceres::Solve, several times slower
};

/// When to stop.
struct SolverLimits {
  int max_iterations = 30;
  /// Squared length of a step in standard deviations, below which it is the last one (docs/method.md, eq. 23a).
  double short_step = 1e-2;
};

struct Solution {
  int iterations = 0;
  SolverTermination termination = SolverTermination::kIterationLimit;
  bool converged() const { return isConverged(termination); }
  NormalEquations normal_equations;  ///< at the solution
  Elimination elimination;           ///< of them
};

/// Moves the blocks to where the cost is least. A block that would cross its bound is held there. Throws
/// std::runtime_error where the terms do not determine the blocks.
///
/// kChain: Gauss-Newton from where the blocks are; where a step does not lower the cost, a half of it and
/// less, then Levenberg-Marquardt damping. Converged where the undamped step is short (that step is still
/// taken). A damped step that is short says nothing.
/// kCeres: in the problem that lives as long as the window. Ceres also calls steps convergence that its trust
/// region made short. So the reason why it ended is told by the undamped step at what it found.
Solution solve(Window& window, const SolverLimits& limits, WindowSolver solver = WindowSolver::kChain);

/// The same without moving anything: no iterations.
Solution linearized(const Window& window);

}  // namespace rio_t
