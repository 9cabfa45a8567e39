#pragma once

#include <string>

namespace rio_t {

/// Why the solver of a window stopped.
enum class SolverTermination {
  kConverged,       ///< the undamped Gauss-Newton step is short (docs/method.md, eq. 23a)
  kAtBound,         ///< the same, with a t_O held at its bound max_time_offset
  kIterationLimit,  ///< `max_iterations` came before that
  kNoDecrease,      ///< the step is long, and none, however short or damped, lowers the cost
};

/// The minimum was found; at the bound, that within the bound.
inline bool isConverged(SolverTermination termination) {
  return termination == SolverTermination::kConverged || termination == SolverTermination::kAtBound;
}

/// In snake case; keys of `solver_terminations`.
std::string toString(SolverTermination termination);

}  // namespace rio_t
