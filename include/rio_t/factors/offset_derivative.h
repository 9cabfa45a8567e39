#pragma once

#include <Eigen/Core>
#include <array>

#include "rio_t/imu/buffer.h"

namespace rio_t {

/// Half of the times over which the derivative with respect to t_O may average the IMU [s]. A vibration at 8
/// Hz and above hardly moves a radar and must not count as acceleration. Motion at 2 Hz, as of people, loses
/// 13 % in the first (docs/method.md, section 5.3). The wider ones are for an IMU that vibrates.
constexpr std::array<double, 3> kOffsetHalfWidths = {0.1, 0.2, 0.4};
constexpr double kOffsetHalfWidth = kOffsetHalfWidths.front();
constexpr double kMaxOffsetHalfWidth = kOffsetHalfWidths.back();

/// Derivative of the radar's velocity with respect to the time of measurement, d/dtau, in I. The derivative
/// with respect to t_O has the opposite sign (docs/method.md, eq. 18).
struct VelocityRate {
  Eigen::Vector3d a_I = Eigen::Vector3d::Zero();  ///< [m/s^2]
  double variance = 0.0;                          ///< per axis, of the IMU's noise in it [m^2/s^4]
};

/// a_c - omega x v_I + alpha x l, from the mean of the IMU around the time of measurement. `v_I` [m/s] and
/// gravity `g_I` [m/s^2] are in I at that time, `l_I` is the radar in I [m].
VelocityRate velocityRate(const ImuMean& imu, const Eigen::Vector3d& b_g, const Eigen::Vector3d& b_a,
                          const Eigen::Vector3d& v_I, const Eigen::Vector3d& g_I, const Eigen::Vector3d& l_I);

}  // namespace rio_t
