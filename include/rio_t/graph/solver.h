#pragma once

#include "rio_t/graph/normal_equations.h"
#include "rio_t/graph/solver_termination.h"
#include "rio_t/graph/window.h"

namespace rio_t {

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

/// Moves the blocks to where the cost is least, with ceres::Solve. A block that would cross its bound is held there.
///
/// Ceres also calls steps convergence that its trust region made short. So the reason why it ended is told by
/// the undamped step at what it found. Throws std::runtime_error where the terms do not determine the blocks.
Solution solve(Window& window, const SolverLimits& limits);

/// The same without moving anything: no iterations.
Solution linearized(const Window& window);

}  // namespace rio_t
