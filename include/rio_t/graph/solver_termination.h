#pragma once

#include <string>

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

}  // namespace rio_t
