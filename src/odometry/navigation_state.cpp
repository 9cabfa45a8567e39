#include "rio_t/odometry/navigation_state.h"

#include <algorithm>

namespace rio_t {
namespace {

/// Derivative of the heading by theta, which is in I.
Eigen::RowVector3d headingByTheta(const Eigen::Quaterniond& q_WI) { return q_WI.toRotationMatrix().row(2); }

}  // namespace

NavigationState navigationState(const NodeEstimate& node, const StateCovariance& covariance,
                                const ImuBuffer& imu) {
  NavigationState state;
  state.time = node.time;
  state.q_WI = node.x.q_WI();
  state.p_W = node.x.p_W();
  state.v_W = node.x.v_W();
  state.b_g = node.x.b_g();
  state.b_a = node.x.b_a();
  state.angular_velocity = imu.at(node.time).angular_velocity - state.b_g;
  state.covariance = covariance;
  return state;
}

Eigen::Matrix<double, 4, StateBlock::kTangent> poseInW(const Eigen::Quaterniond& q_WI) {
  Eigen::Matrix<double, 4, StateBlock::kTangent> E = Eigen::Matrix<double, 4, StateBlock::kTangent>::Zero();
  E.block<1, 3>(0, StateBlock::kTheta) = headingByTheta(q_WI);
  E.block<3, 3>(1, StateBlock::kP).setIdentity();
  return E;
}

void addHeadingCurvature(NavigationState& state) {
  using S = StateBlock;
  const Eigen::Vector3d heading = headingByTheta(state.q_WI);
  const StateTangent with_heading = state.covariance.middleCols<3>(S::kTheta) * heading;
  const double variance = heading.dot(with_heading.segment<3>(S::kTheta));
  if (variance <= 0.0) return;
  // A turn by psi moves p and v by psi u, and shortens them by psi^2 / 2 along z x u.
  static_assert(S::kV == S::kP + 3);
  Eigen::Matrix<double, 6, 1> shorten;
  for (const int first : {0, 3})
    shorten.segment<3>(first) =
        Eigen::Vector3d::UnitZ().cross(with_heading.segment<3>(S::kP + first) / variance);
  // The mean square of psi^2 / 2, but at most that of 1 - cos(psi) over all psi.
  state.covariance.block<6, 6>(S::kP, S::kP) +=
      std::min(0.75 * variance * variance, 1.5) * shorten * shorten.transpose();
}

}  // namespace rio_t
