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
  const StateView from(x), to(y);
  const StateTangent delta = boxminus(y, x);
  const Eigen::Matrix3d J_theta = so3::rightJacobianInverse(delta.head<3>());
  const Eigen::Matrix3d R_WI = from.q_WI.toRotationMatrix();
  const double psi = (R_WI * delta.head<3>()).z();
  const Eigen::Vector3d z_W = Eigen::Vector3d::UnitZ();
  const Eigen::Matrix3d turn_back = so3::exp(-psi * z_W).toRotationMatrix();
  Eigen::MatrixXd J = Eigen::MatrixXd::Identity(StateBlock::kTangent, StateBlock::kTangent);
  J.topLeftCorner<3, 3>() = J_theta;
  J.block<3, 3>(StateBlock::kV, StateBlock::kV) = turn_back;
  J.block<3, 3>(StateBlock::kV, StateBlock::kTheta) =
      z_W.cross(from.v_W - turn_back * to.v_W) * (R_WI * J_theta).row(2);
  return J;
}

}  // namespace rio_t
