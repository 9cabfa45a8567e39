#include "rio_t/factors/state_block.h"

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
  const Eigen::Map<const Eigen::Vector3d> theta(delta + StateBlock::kTheta);
  const Eigen::Vector3d turn_W = {0.0, 0.0, (state.q_WI * theta).z()};
  const Eigen::Quaterniond q_WI = (state.q_WI * so3::exp(theta)).normalized();
  Linear moved = linear(x) + Eigen::Map<const Linear>(delta + StateBlock::kP);
  auto v_W = moved.segment<3>(StateBlock::kV - StateBlock::kP);
  v_W = so3::exp(turn_W) * (v_W - turn_W.cross(state.v_W));
  Eigen::Map<Eigen::Quaterniond>{x_plus_delta} = q_WI;
  Eigen::Map<Linear>{x_plus_delta + StateBlock::kPStored} = moved;
}

StateTangent boxminus(const double* y, const double* x) {
  const StateView from(x), to(y);
  const Eigen::Vector3d theta = so3::log(from.q_WI.conjugate() * to.q_WI);
  const Eigen::Vector3d turn_W = {0.0, 0.0, (from.q_WI * theta).z()};
  StateTangent delta;
  delta << theta, linear(y) - linear(x);
  delta.segment<3>(StateBlock::kV) = so3::exp(-turn_W) * to.v_W - from.v_W + turn_W.cross(from.v_W);
  return delta;
}

}  // namespace rio_t
