#include "rio_t/factors/state_manifold.h"

#include "rio_t/core/so3.h"

namespace rio_t {

StateManifold::StateManifold()
    : Manifold(StateBlock::kSize, {0, 1, 2, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15}) {}

void StateManifold::plus(const double* x, const double* delta, double* x_plus_delta) const {
  boxplus(x, delta, x_plus_delta);
}

Eigen::VectorXd StateManifold::minus(const double* y, const double* x) const { return boxminus(y, x); }

Eigen::MatrixXd StateManifold::minusJacobian(const double* y, const double* x) const {
  Eigen::MatrixXd J = Eigen::MatrixXd::Identity(StateBlock::kTangent, StateBlock::kTangent);
  J.topLeftCorner<3, 3>() = so3::rightJacobianInverse(boxminus(y, x).head<3>());
  return J;
}

}  // namespace rio_t
