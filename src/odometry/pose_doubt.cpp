#include "rio_t/odometry/pose_doubt.h"

#include "rio_t/factors/state_block.h"

namespace rio_t {

PoseDoubt::PoseDoubt(const NavigationState& published)
    : position_(published.covariance.block<3, 3>(StateBlock::kP, StateBlock::kP)), pivot_W_(published.p_W) {
  const Eigen::Vector3d up_I = published.q_WI.conjugate() * Eigen::Vector3d::UnitZ();
  heading_ = up_I.dot(published.covariance.topLeftCorner<3, 3>() * up_I);
}

void PoseDoubt::addTo(NavigationState& state) const {
  state.covariance.block<3, 3>(StateBlock::kP, StateBlock::kP) += position_;
  // One angle about the vertical through the pivot turns all three.
  Eigen::Matrix<double, StateBlock::kTangent, 1> turn =
      Eigen::Matrix<double, StateBlock::kTangent, 1>::Zero();
  const Eigen::Vector3d up_W = Eigen::Vector3d::UnitZ();
  turn.segment<3>(StateBlock::kTheta) = state.q_WI.conjugate() * up_W;
  turn.segment<3>(StateBlock::kP) = up_W.cross(state.p_W - pivot_W_);
  turn.segment<3>(StateBlock::kV) = up_W.cross(state.v_W);
  state.covariance += heading_ * turn * turn.transpose();
}

}  // namespace rio_t
