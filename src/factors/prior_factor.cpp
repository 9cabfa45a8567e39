#include "rio_t/factors/prior_factor.h"

#include "rio_t/core/so3.h"

namespace rio_t {

bool PriorFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  NodeVector delta;
  delta.head<StateBlock::kTangent>() = boxminus(parameters[0], prior_.x0.data());
  delta(StateBlock::kTangent) = parameters[1][0] - prior_.t_O0;
  Eigen::Map<NodeVector>{residuals} = prior_.r0 + prior_.J * delta;
  if (jacobians == nullptr) return true;

  if (jacobians[0] != nullptr) {
    Eigen::Map<StateJacobian<kNodeTangent>> J(jacobians[0]);
    const Eigen::Vector3d theta = delta.head<3>();
    J.leftCols<3>() = prior_.J.leftCols<3>() * so3::rightJacobianInverse(theta);
    J.col(3).setZero();
    J.rightCols<StateBlock::kTangent - 3>() = prior_.J.middleCols<StateBlock::kTangent - 3>(3);
  }
  if (jacobians[1] != nullptr) Eigen::Map<NodeVector>{jacobians[1]} = prior_.J.col(StateBlock::kTangent);
  return true;
}

}  // namespace rio_t
