#pragma once

#include <ceres/cost_function.h>

#include <vector>

#include "rio_t/graph/normal_equations.h"
#include "rio_t/graph/window.h"

namespace rio_t {

/// What is known of some blocks, linear in their tangents at x0: residual r0 + J (x [-] x0). The prior at the start, and
/// what marginalisation leaves of all that has left the window.
class PriorTerm final : public ceres::CostFunction {
 public:
  /// `x0` and `manifolds` of each block; the columns of J are their tangents, one after the other.
  PriorTerm(std::vector<std::shared_ptr<const Manifold>> manifolds, std::vector<Eigen::VectorXd> x0,
            SquareRoot root);
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  std::vector<std::shared_ptr<const Manifold>> manifolds_;
  std::vector<Eigen::VectorXd> x0_;
  SquareRoot root_;
};

/// Adds what is known of `blocks` around the values that they have now.
Term& addPrior(Window& window, const std::vector<Block*>& blocks, const SquareRoot& root);

/// A calibration block that changes as a random walk: what the prior says of it fades.
struct Walk {
  const Block* block;
  double variance;  ///< that it gains, per direction of its tangent
};
/// Takes `leaving` out of the window. A prior on the blocks that they touch keeps what they and the terms on
/// them said.
void marginalize(Window& window, std::vector<const Block*> leaving, const std::vector<Walk>& walks);

}  // namespace rio_t
