#include "rio_t/factors/state_block.h"

#include <cmath>

#include "rio_t/core/so3.h"

namespace rio_t {
namespace {

using Linear = Eigen::Matrix<double, StateBlock::kTangent - 3, 1>;  // p, v, b_g, b_a, as they are stored

Eigen::Map<const Linear> linear(const double* x) {
  return Eigen::Map<const Linear>(x + StateBlock::kPStored);
}

}  // namespace

void boxplus(const double* x, const double* delta, double* x_plus_delta) {
  const StateView state(x);
  const Eigen::Vector3d theta_W = state.q_WI * Eigen::Map<const Eigen::Vector3d>(delta + StateBlock::kTheta);
  const Eigen::Vector3d turn_W = {0.0, 0.0, theta_W.z()};
  const Eigen::Vector3d tilt_W = {theta_W.x(), theta_W.y(), 0.0};
  const Eigen::Quaterniond turn = so3::exp(turn_W);
  const Eigen::Quaterniond q_WI = (turn * so3::exp(tilt_W) * state.q_WI).normalized();
  Linear moved = linear(x) + Eigen::Map<const Linear>(delta + StateBlock::kP);
  auto v_W = moved.segment<3>(StateBlock::kV - StateBlock::kP);
  v_W = turn * (v_W - turn_W.cross(state.v_W));
  Eigen::Map<Eigen::Quaterniond>{x_plus_delta} = q_WI;
  Eigen::Map<Linear>{x_plus_delta + StateBlock::kPStored} = moved;
}

StateTangent boxminus(const double* y, const double* x) {
  const StateView from(x), to(y);
  const Eigen::Quaterniond both = to.q_WI * from.q_WI.conjugate();  // Exp(turn_W) Exp(tilt_W)
  const Eigen::Vector3d turn_W = {0.0, 0.0, std::remainder(2.0 * std::atan2(both.z(), both.w()), 2.0 * M_PI)};
  const Eigen::Quaterniond turn_back = so3::exp(-turn_W);
  const Eigen::Vector3d tilt_W = so3::log(turn_back * both);
  StateTangent delta;
  delta << from.q_WI.conjugate() * (turn_W + tilt_W), linear(y) - linear(x);
  delta.segment<3>(StateBlock::kV) = turn_back * to.v_W - from.v_W + turn_W.cross(from.v_W);
  return delta;
}

}  // namespace rio_t
