#pragma once

#include <ceres/cost_function.h>

#include <cstddef>
#include <optional>
#include <vector>

#include "rio_t/graph/elimination.h"
#include "rio_t/graph/window.h"

namespace rio_t {

/// A prior on some blocks, linear in their tangents at x0: residual r0 + J (x [-] x0). A window starts with a
/// prior. Marginalisation replaces the blocks that leave by a prior.
///
/// Points are the exception: the residual is linear in their positions in the axes of the first node among
/// the blocks. So a turn or a shift of the whole world does not change the residual, even after the estimates
/// have moved (docs/method.md, section 16).
class PriorTerm final : public ceres::CostFunction {
 public:
  /// `x0` and `manifolds` of each block; the columns of J are their tangents, one after the other.
  PriorTerm(std::vector<std::shared_ptr<const Manifold>> manifolds, std::vector<Eigen::VectorXd> x0,
            SquareRoot root);
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  /// Rewrites x0 and the columns of J for points in the axes of the node.
  void referPointsToNode();
  void addPoints(double const* const* parameters, double* residuals, double** jacobians) const;

  std::vector<std::shared_ptr<const Manifold>> manifolds_;
  std::vector<Eigen::VectorXd> x0_;  ///< of a point: its position in the axes of the node
  SquareRoot root_;                  ///< of a point: the derivative by that position
  std::vector<Eigen::Index> first_;  ///< column of each block
  std::optional<std::size_t> node_;  ///< the block whose axes the points refer to
  std::vector<std::size_t> points_;  ///< the blocks that are points; empty without a node
};

/// Adds a prior on `blocks` around their current values.
void addPrior(Window& window, const std::vector<Block*>& blocks, const SquareRoot& root);
/// The same on one block, with the sigmas of its tangent.
void addPrior(Window& window, Block& block, const Eigen::VectorXd& sigmas);

/// Random walk of a block. It lowers the information that the prior has about the block.
struct Walk {
  const Block* block;
  Eigen::VectorXd variance;  ///< gained, per direction of the tangent
  Eigen::Index first = 0;    ///< direction that `variance` begins with
};
/// Removes `leaving` and the terms on them from the window. A prior on the neighbours of `leaving` keeps the
/// information of these terms.
void marginalize(Window& window, std::vector<const Block*> leaving, const std::vector<Walk>& walks);

}  // namespace rio_t
