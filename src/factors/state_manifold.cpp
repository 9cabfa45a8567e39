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
  const Eigen::Vector3d z_W = Eigen::Vector3d::UnitZ();
  const Eigen::Matrix3d R_WI = from.q_WI.toRotationMatrix();
  const Eigen::Vector3d theta_W = R_WI * boxminus(y, x).head<3>();
  const Eigen::Vector3d tilt_W = {theta_W.x(), theta_W.y(), 0.0};
  const Eigen::Matrix3d turn = so3::exp(theta_W.z() * z_W).toRotationMatrix();
  // The columns say how R_WI(y) = turn Exp(tilt_W) R_WI(x) turns in W with tilt x, tilt y and the turn.
  Eigen::Matrix3d turned_W = turn * so3::rightJacobian(-tilt_W);
  turned_W.col(2) = z_W;
  const Eigen::Matrix3d J_theta_W = turned_W.inverse() * to.q_WI.toRotationMatrix();
  Eigen::MatrixXd J = Eigen::MatrixXd::Identity(StateBlock::kTangent, StateBlock::kTangent);
  J.topLeftCorner<3, 3>() = R_WI.transpose() * J_theta_W;
  J.block<3, 3>(StateBlock::kV, StateBlock::kV) = turn.transpose();
  J.block<3, 3>(StateBlock::kV, StateBlock::kTheta) =
      z_W.cross(from.v_W - turn.transpose() * to.v_W) * J_theta_W.row(2);
  return J;
}

}  // namespace rio_t
