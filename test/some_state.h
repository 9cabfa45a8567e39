#pragma once

#include <cmath>

#include "rio_t/core/so3.h"
#include "rio_t/odometry/navigation_state.h"

namespace rio_t {

/// A state in general position, whose covariance correlates everything with everything.
inline NavigationState someState() {
  NavigationState state;
  state.time = Time::fromNanoseconds(1700000000123456789);
  state.q_WI = so3::exp({0.3, -0.8, 1.9});
  state.p_W = {1.0, -2.0, 3.0};
  state.v_W = {0.7, 1.1, -0.4};
  state.b_g = {0.01, -0.02, 0.03};
  state.b_a = {0.1, 0.2, -0.3};
  state.angular_velocity = {0.5, -0.6, 0.7};
  // Positive definite with every block correlated.
  StateCovariance L = StateCovariance::Zero();
  for (int row = 0; row < 15; ++row) {
    for (int column = 0; column <= row; ++column) L(row, column) = 0.1 * std::sin(1.0 + 3.0 * row + column);
    L(row, row) += 0.2;
  }
  state.covariance = L * L.transpose();
  return state;
}

}  // namespace rio_t
