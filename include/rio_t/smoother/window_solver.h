#pragma once

#include <optional>
#include <vector>

#include "rio_t/smoother/chain.h"
#include "rio_t/smoother/solver_termination.h"
#include "rio_t/smoother/window.h"

namespace rio_t {

/// When to stop.
struct SolverLimits {
  int max_iterations = 30;
  /// Squared length of a step in standard deviations, below which it is the last one (eq. 23a).
  double short_step = 1e-2;
};

struct SolveReport {
  int iterations = 0;  ///< linearisations
  SolverTermination termination = SolverTermination::kIterationLimit;
  bool converged() const { return isConverged(termination); }
};

/// Gauss-Newton or Levenberg-Marquardt step of a window, with the bound on t_O as an active set: a t_O that
/// the step would take across its bound stops there, and the others are solved given that. It is held for as
/// long as the cost falls outwards. Keeps its memory from call to call.
class WindowStep {
 public:
  /// With `system` linearised at the nodes of `window`. False where H + damping diag(H) is not positive
  /// definite; without damping it is lifted as in `solveUndamped`.
  bool solve(const Window& window, const ChainSystem& system, double damping);
  /// Moves the nodes by `share` of the step.
  void take(double share, Window& window) const;

  /// delta' (H + damping diag(H)) delta: squared length in sigmas. Infinite where the active set did not
  /// settle.
  double length() const { return length_; }
  /// The bound at which t_O,k is held [s].
  std::optional<double> heldAt(std::size_t k) const { return held_[k]; }
  bool atBound() const { return at_bound_; }  ///< of any node
  /// What was solved last. Its rows of the t_O that are held are empty.
  ChainSolution& solution() { return solution_; }

 private:
  void holdWherePushedOutwards(const Window& window, const ChainSystem& system);
  bool solveWithHeld(const Window& window, const ChainSystem& system, double damping);
  bool holdWhereCrossed(const Window& window);
  bool releaseWherePulledInwards(const ChainSystem& system, double damping);

  ChainSolution solution_;
  ChainSystem reduced_;  // without the t_O that are held
  std::vector<std::optional<double>> held_;
  double length_ = 0.0;
  bool at_bound_ = false;
};

/// Minimises the window with Ceres's cost functions and loss, and the elimination of chain.h (docs/method.md,
/// section 6). It takes the same steps as `solveWithCeres` without setting up a problem, ordering unknowns
/// and analysing a sparse matrix for each scan, and the covariance falls out of the last elimination.
///
/// Gauss-Newton from where the nodes are; where a step does not lower the cost, a half of it and less, then
/// Levenberg-Marquardt damping. Converged where the undamped step is shorter than 0.1 standard deviations in
/// every direction (that step is still taken). A damped step that is short says nothing. Keeps its memory
/// from call to call.
class WindowSolver {
 public:
  SolveReport solve(Window& window, const SolverLimits& limits);
  /// Marginal covariance of the newest node at the last linearisation of the last `solve`.
  const NodeMatrix& newestCovariance() const { return covariance_; }

 private:
  bool stepLowersCost(Window& window);  ///< takes the step or a share of it; none where none does

  ChainSystem system_;     // at the nodes
  ChainSystem candidate_;  // at the nodes after a step
  WindowStep step_;
  std::vector<StateBlock> states_before_;
  std::vector<double> offsets_before_;
  NodeMatrix covariance_ = NodeMatrix::Zero();
};

/// The same with Ceres's own minimiser (sparse normal Cholesky); for comparison and for who trusts it more.
/// Ceres also calls steps convergence that its trust region made short: the undamped step at what it found
/// tells the reason.
SolveReport solveWithCeres(Window& window, const SolverLimits& limits);

/// Marginal covariance of the newest node, linearised at the nodes.
NodeMatrix newestCovariance(const Window& window);

/// Normal equations of the whole window at its nodes; `system` keeps its memory.
void linearize(const Window& window, ChainSystem* system);

}  // namespace rio_t
