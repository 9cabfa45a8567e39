#include "rio_t/odometry/navigation_state.h"

namespace rio_t {

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

}  // namespace rio_t
