#include "rio_t/odometry/pose_inflation.h"

#include <algorithm>

#include "rio_t/factors/state_block.h"

namespace rio_t {
namespace {

using S = StateBlock;

/// How the state moves when W turns about the vertical through `pivot_W` [m]: one angle turns all three.
StateTangent turnAbout(const Eigen::Vector3d& pivot_W, const NavigationState& state) {
  const Eigen::Vector3d up_W = Eigen::Vector3d::UnitZ();
  StateTangent turn = StateTangent::Zero();
  turn.segment<3>(S::kTheta) = state.q_WI.conjugate() * up_W;
  turn.segment<3>(S::kP) = up_W.cross(state.p_W - pivot_W);
  turn.segment<3>(S::kV) = up_W.cross(state.v_W);
  return turn;
}

/// [rad^2] of a turn about the vertical.
double headingVariance(const NavigationState& state) {
  const Eigen::Vector3d up_I = state.q_WI.conjugate() * Eigen::Vector3d::UnitZ();
  return up_I.dot(state.covariance.block<3, 3>(S::kTheta, S::kTheta) * up_I);
}

}  // namespace

PoseInflation::PoseInflation(const NavigationState& published)
    : position_(published.covariance.block<3, 3>(S::kP, S::kP)),
      heading_(headingVariance(published)),
      pivot_W_(published.p_W) {}

void PoseInflation::addTo(NavigationState& state) const {
  state.covariance.block<3, 3>(S::kP, S::kP) += position_;
  const StateTangent turn = turnAbout(pivot_W_, state);
  state.covariance += heading_ * turn * turn.transpose();
}

void YawInflation::add(double variance, const Eigen::Vector3d& p_W) {
  variance_ += variance;
  lost_at_W_ = p_W;
}

void YawInflation::addTo(NavigationState& state) const {
  if (variance_ == 0.0) return;
  const double missing = variance_ - headingVariance(state);
  if (missing > 0.0) {
    const StateTangent turn = turnAbout(lost_at_W_, state);
    state.covariance += missing * turn * turn.transpose();
  }
  // A yaw that may be wrong by a radian also shortens: with psi of variance s^2, 1 - cos(psi) is about psi^2
  // / 2, whose mean square is 3 s^4 / 4. Not beyond what a turn can do.
  StateTangent shorten = StateTangent::Zero();
  shorten.segment<2>(S::kP) = (state.p_W - lost_at_W_).head<2>();
  shorten.segment<2>(S::kV) = state.v_W.head<2>();
  state.covariance += std::min(0.75 * variance_ * variance_, 1.5) * shorten * shorten.transpose();
}

}  // namespace rio_t
