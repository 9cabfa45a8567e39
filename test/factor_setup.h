#pragma once

#include <cmath>
#include <vector>

#include "rio_t/core/so3.h"
#include "rio_t/factors/radar_velocity_factor.h"
#include "rio_t/factors/state_block.h"
#include "synthetic_motion.h"

/// A state, a measurement and a mounting in general position, for tests of factors.
namespace rio_t {

inline StateBlock moved(const StateBlock& x, double size) {
  StateTangent delta;
  for (int i = 0; i < StateBlock::kTangent; ++i) delta(i) = size * std::sin(1.0 + 2.3 * i);
  StateBlock y;
  boxplus(x.data(), delta.data(), y.data());
  return y;
}

inline RadarVelocityMeasurement measurement(Time stamp) {
  RadarVelocityMeasurement z;
  z.stamp = stamp;
  z.v_R = {0.3, 1.1, -0.2};
  z.covariance << 0.01, 0.002, 0.0, 0.002, 0.004, 0.001, 0.0, 0.001, 0.02;
  return z;
}

inline Extrinsics mounting() {
  return {{0.03, -0.5, 0.2}, Eigen::Quaterniond(so3::exp({0.3, -1.2, 2.0}).conjugate())};
}

inline const std::vector<double>& storedMounting() {
  static const Eigen::VectorXd x = stored(mounting());
  static const std::vector<double> values(x.data(), x.data() + x.size());
  return values;
}

inline RadarMotionModel imuModel(const ImuBuffer& imu, double max_time_offset = 0.25) {
  return {TimeOffsetModel::kImu, max_time_offset, SyntheticMotion().g_W, &imu};
}

}  // namespace rio_t
