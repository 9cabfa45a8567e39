#include "rio_t/odometry/body_odometry.h"

#include <cmath>

#include "rio_t/core/so3.h"
#include "rio_t/factors/state_block.h"

namespace rio_t {
namespace {

using S = StateBlock;
using Jacobian = Eigen::Matrix<double, 6, S::kTangent>;

/// The turn about z in q (swing and twist). The rest of q is a turn about a horizontal axis.
Eigen::Quaterniond turnAboutZ(const Eigen::Quaterniond& q) {
  constexpr double kUndefined = 1e-6;  // both vanish if q turns z upside down
  if (std::hypot(q.w(), q.z()) < kUndefined) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(q.w(), 0.0, 0.0, q.z()).normalized();
}

}  // namespace

WorldInOdom placeWorld(const StampedPose& start, const ImuInBody& T_BI, const BodyOdometry& last) {
  const Eigen::Quaterniond q_WB = start.q_WI * T_BI.q_BI.conjugate();
  const Eigen::Vector3d p_W = start.p_W + start.q_WI * T_BI.bodyOrigin_I();
  WorldInOdom T_OW;
  T_OW.q_OW = turnAboutZ(last.q_OB * q_WB.conjugate());
  T_OW.p_O = last.p_O - T_OW.q_OW * p_W;
  T_OW.anchor_O = last.p_O;
  T_OW.covariance.topLeftCorner<3, 3>() = last.pose_covariance.topLeftCorner<3, 3>();
  T_OW.covariance.topRightCorner<3, 1>() = last.pose_covariance.block<3, 1>(0, 5);
  T_OW.covariance.bottomLeftCorner<1, 3>() = last.pose_covariance.block<1, 3>(5, 0);
  T_OW.covariance(3, 3) = last.pose_covariance(5, 5);
  return T_OW;
}

BodyOdometry bodyOdometry(const NavigationState& state, double rate_sigma, const ImuInBody& T_BI,
                          const WorldInOdom& T_OW) {
  const Eigen::Vector3d l_I = T_BI.bodyOrigin_I();
  const Eigen::Vector3d v_I = state.q_WI.conjugate() * state.v_W;
  const Eigen::Matrix3d R_BI = T_BI.q_BI.toRotationMatrix();
  const Eigen::Matrix3d R_OW = T_OW.q_OW.toRotationMatrix();
  const Eigen::Matrix3d R_OI = R_OW * state.q_WI.toRotationMatrix();

  BodyOdometry body;
  body.time = state.time;
  body.q_OB = (T_OW.q_OW * state.q_WI * T_BI.q_BI.conjugate()).normalized();
  body.p_O = T_OW.p_O + R_OW * state.p_W + R_OI * l_I;
  body.v_B = R_BI * (v_I + state.angular_velocity.cross(l_I));
  body.omega_B = R_BI * state.angular_velocity;

  Jacobian pose = Jacobian::Zero();
  pose.block<3, 3>(0, S::kP) = R_OW;
  pose.block<3, 3>(0, S::kTheta) = -R_OI * so3::hat(l_I);
  pose.block<3, 3>(3, S::kTheta) = R_OI;
  body.pose_covariance = pose * state.covariance * pose.transpose();
  Eigen::Matrix<double, 6, 4> world = Eigen::Matrix<double, 6, 4>::Zero();
  world.topLeftCorner<3, 3>().setIdentity();
  world.block<3, 1>(0, 3) = Eigen::Vector3d::UnitZ().cross(body.p_O - T_OW.anchor_O);
  world(5, 3) = 1.0;
  body.pose_covariance += world * T_OW.covariance * world.transpose();

  // The error of the angular velocity is that of the bias, with a minus sign, and the noise of the sample.
  Eigen::Matrix<double, 6, 3> rate;
  rate.topRows<3>() = -R_BI * so3::hat(l_I);
  rate.bottomRows<3>() = R_BI;
  Jacobian twist = Jacobian::Zero();
  twist.block<3, 3>(0, S::kTheta) = R_BI * so3::hat(v_I);
  twist.block<3, 3>(0, S::kV) = R_BI * state.q_WI.conjugate().toRotationMatrix();
  twist.block<6, 3>(0, S::kBg) = -rate;
  body.twist_covariance =
      twist * state.covariance * twist.transpose() + rate_sigma * rate_sigma * rate * rate.transpose();
  return body;
}

}  // namespace rio_t
