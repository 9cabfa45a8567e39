#pragma once

#include <ceres/sized_cost_function.h>

#include "rio_t/factors/state_block.h"

namespace rio_t {

/// Tangent of one node of the chain: the state's 15, then t_O.
constexpr int kNodeTangent = StateBlock::kTangent + 1;
using NodeVector = Eigen::Matrix<double, kNodeTangent, 1>;
using NodeMatrix = Eigen::Matrix<double, kNodeTangent, kNodeTangent>;

/// What is known of one node beforehand, linear in the tangent at `x0`: residual r0 + J (x [-] x0).
/// The prior at the start, and what marginalisation leaves of all that has left the window.
struct NodePrior {
  StateBlock x0;
  double t_O0 = 0.0;  ///< [s]
  NodeMatrix J = NodeMatrix::Zero();
  NodeVector r0 = NodeVector::Zero();
};

/// NodePrior as a factor. Blocks: state, t_O.
class PriorFactor final : public ceres::SizedCostFunction<kNodeTangent, StateBlock::kSize, 1> {
 public:
  explicit PriorFactor(const NodePrior& prior) : prior_(prior) {}
  void set(const NodePrior& prior) { prior_ = prior; }  ///< as if made anew
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;
  const NodePrior& prior() const { return prior_; }

 private:
  NodePrior prior_;
};

}  // namespace rio_t
