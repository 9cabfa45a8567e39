#include "rio_t/odometry/yaw_doubt.h"

#include <algorithm>

#include "rio_t/factors/state_block.h"

namespace rio_t {

void YawDoubt::add(double variance, const Eigen::Vector3d& p_W) {
  variance_ += variance;
  lost_at_W_ = p_W;
}

void YawDoubt::addTo(NavigationState& state) const {
  if (variance_ == 0.0) return;
  using S = StateBlock;
  using Direction = Eigen::Matrix<double, S::kTangent, 1>;
  const Eigen::Vector3d up_W = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d up_I = state.q_WI.conjugate() * up_W;
  const Eigen::Vector3d from_there = state.p_W - lost_at_W_;
  const double missing = variance_ - up_I.dot(state.covariance.block<3, 3>(S::kTheta, S::kTheta) * up_I);
  if (missing > 0.0) {
    // How the state moves when W turns about the vertical through the place where the yaw was lost.
    Direction turn = Direction::Zero();
    turn.segment<3>(S::kTheta) = up_I;
    turn.segment<3>(S::kP) = up_W.cross(from_there);
    turn.segment<3>(S::kV) = up_W.cross(state.v_W);
    state.covariance += missing * turn * turn.transpose();
  }
  // A yaw that may be wrong by a radian also shortens: with psi of variance s^2, 1 - cos(psi) is about psi^2
  // / 2, whose mean square is 3 s^4 / 4. Not beyond what a turn can do.
  Direction shorten = Direction::Zero();
  shorten.segment<2>(S::kP) = from_there.head<2>();
  shorten.segment<2>(S::kV) = state.v_W.head<2>();
  state.covariance += std::min(0.75 * variance_ * variance_, 1.5) * shorten * shorten.transpose();
}

}  // namespace rio_t
