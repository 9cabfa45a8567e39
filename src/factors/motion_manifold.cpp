#include "rio_t/factors/motion_manifold.h"

#include <cmath>

#include "rio_t/core/so3.h"

namespace rio_t {
namespace {

using S = StateBlock;

/// theta in W, of Exp(turn_W) Exp(tilt_W) = R_WI(to) R_IW(from).
Eigen::Vector3d thetaInW(const MotionView& to, const MotionView& from) {
  const Eigen::Quaterniond both = to.q_WI * from.q_WI.conjugate();
  const double turn = std::remainder(2.0 * std::atan2(both.z(), both.w()), 2.0 * M_PI);
  Eigen::Vector3d theta_W = so3::log(so3::exp(Eigen::Vector3d(0.0, 0.0, -turn)) * both);
  theta_W.z() += turn;
  return theta_W;
}

}  // namespace

MotionManifold::MotionManifold() : Manifold(S::kMotion, {0, 1, 2, 4, 5, 6, 7, 8, 9}) {}

void MotionManifold::plus(const double* x, const double* delta, double* x_plus_delta) const {
  const MotionView from(x);
  const auto part = [&](int first) { return Eigen::Map<const Eigen::Vector3d>(delta + first); };
  const Eigen::Vector3d theta_W = from.q_WI * part(S::kTheta);
  const Eigen::Vector3d turn_W = {0.0, 0.0, theta_W.z()};
  const Eigen::Vector3d tilt_W = {theta_W.x(), theta_W.y(), 0.0};
  const Eigen::Quaterniond turn = so3::exp(turn_W);
  const Eigen::Quaterniond q_WI = (turn * so3::exp(tilt_W) * from.q_WI).normalized();
  const Eigen::Vector3d p_W = from.p_W + part(S::kP);
  const Eigen::Vector3d v_W = turn * (from.v_W + part(S::kV) - turn_W.cross(from.v_W));
  Eigen::Map<Eigen::Quaterniond>{x_plus_delta + S::kQStored} = q_WI;
  Eigen::Map<Eigen::Vector3d>{x_plus_delta + S::kPStored} = p_W;
  Eigen::Map<Eigen::Vector3d>{x_plus_delta + S::kVStored} = v_W;
}

Eigen::VectorXd MotionManifold::minus(const double* y, const double* x) const {
  const MotionView from(x), to(y);
  const Eigen::Vector3d theta_W = thetaInW(to, from);
  const Eigen::Vector3d turn_W = {0.0, 0.0, theta_W.z()};
  Eigen::VectorXd delta(S::kMotionTangent);
  delta << from.q_WI.conjugate() * theta_W, to.p_W - from.p_W,
      so3::exp(-turn_W) * to.v_W - from.v_W + turn_W.cross(from.v_W);
  return delta;
}

Eigen::MatrixXd MotionManifold::minusJacobian(const double* y, const double* x) const {
  const MotionView from(x), to(y);
  const Eigen::Vector3d z_W = Eigen::Vector3d::UnitZ();
  const Eigen::Matrix3d R_WI = from.q_WI.toRotationMatrix();
  const Eigen::Vector3d theta_W = thetaInW(to, from);
  const Eigen::Vector3d tilt_W = {theta_W.x(), theta_W.y(), 0.0};
  const Eigen::Matrix3d turn = so3::exp(theta_W.z() * z_W).toRotationMatrix();
  // The columns: how R_WI(y) = turn Exp(tilt_W) R_WI(x) turns in W if tilt x, tilt y or the turn changes.
  Eigen::Matrix3d turned_W = turn * so3::rightJacobian(-tilt_W);
  turned_W.col(2) = z_W;
  const Eigen::Matrix3d J_theta_W = turned_W.inverse() * to.q_WI.toRotationMatrix();
  Eigen::MatrixXd J = Eigen::MatrixXd::Identity(S::kMotionTangent, S::kMotionTangent);
  J.topLeftCorner<3, 3>() = R_WI.transpose() * J_theta_W;
  J.block<3, 3>(S::kV, S::kV) = turn.transpose();
  J.block<3, 3>(S::kV, S::kTheta) = z_W.cross(from.v_W - turn.transpose() * to.v_W) * J_theta_W.row(2);
  return J;
}

std::optional<PointFromNode> MotionManifold::see(const double* x, const double* point) const {
  const MotionView from(x);
  const Eigen::Matrix3d R_IW = from.q_WI.toRotationMatrix().transpose();
  PointFromNode seen{R_IW * (Eigen::Map<const Eigen::Vector3d>(point) - from.p_W),
                     Eigen::Matrix3Xd::Zero(3, S::kMotionTangent), R_IW};
  seen.J_node.middleCols<3>(S::kTheta) = so3::hat(seen.p);
  seen.J_node.middleCols<3>(S::kP) = -R_IW;
  return seen;
}

}  // namespace rio_t
