#pragma once

#include <vector>

#include "rio_t/smoother/chain.h"
#include "rio_t/smoother/window.h"

namespace rio_t {

struct SolveReport {
  int iterations = 0;  ///< linearisations
  bool converged = false;
};

/// Minimises the window with Ceres's cost functions and loss, and the elimination of chain.h (docs/method.md,
/// section 6). It takes the same steps as `solveWithCeres` without setting up a problem, ordering unknowns
/// and analysing a sparse matrix for each scan, and the covariance falls out of the last elimination.
///
/// Gauss-Newton from where the nodes are; where a step raises the cost, a half of it and less, then
/// Levenberg-Marquardt damping. Ends where a step is shorter than 0.1 standard deviations in every direction
/// (that step is still taken), where none lowers the cost by more than such a step would, or after
/// `max_iterations`. Keeps its memory from call to call.
class WindowSolver {
 public:
  SolveReport solve(Window& window, int max_iterations);
  /// Marginal covariance of the newest node at the last linearisation of the last `solve`.
  const NodeMatrix& newestCovariance() const { return covariance_; }

 private:
  bool stepLowersCost(Window& window);  ///< takes the step or a share of it; none where none does

  ChainSystem system_;     // at the nodes
  ChainSystem candidate_;  // at the nodes after a step
  ChainSolution solution_;
  std::vector<StateBlock> states_before_;
  std::vector<double> offsets_before_;
  NodeMatrix covariance_ = NodeMatrix::Zero();
};

/// The same with Ceres's own minimiser (sparse normal Cholesky); for comparison and for who trusts it more.
SolveReport solveWithCeres(Window& window, int max_iterations);

/// Marginal covariance of the newest node, linearised at the nodes.
NodeMatrix newestCovariance(const Window& window);

/// Normal equations of the whole window at its nodes; `system` keeps its memory.
void linearize(const Window& window, ChainSystem* system);

}  // namespace rio_t
