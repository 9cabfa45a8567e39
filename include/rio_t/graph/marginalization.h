#pragma once

#include <ceres/cost_function.h>

#include <vector>

#include "rio_t/graph/elimination.h"
#include "rio_t/graph/window.h"

namespace rio_t {

/// A prior on some blocks, linear in their tangents at x0: residual r0 + J (x [-] x0). A window starts with
/// one, and marginalisation adds one that stands for all that has left.
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

/// Adds a prior on `blocks` around their current values.
Term& addPrior(Window& window, const std::vector<Block*>& blocks, const SquareRoot& root);

/// Random walk of a block. It lowers the information that the prior has about the block.
struct Walk {
  const Block* block;
  Eigen::VectorXd variance;  ///< that the block gains, per direction of its tangent
  Eigen::Index first = 0;    ///< direction that `variance` begins with
};
/// Removes `leaving` and the terms on them from the window. One prior on the neighbours of `leaving` keeps
/// what these terms said.
void marginalize(Window& window, std::vector<const Block*> leaving, const std::vector<Walk>& walks);

}  // namespace rio_t
