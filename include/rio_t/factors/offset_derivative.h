#pragma once

#include <Eigen/Core>

#include "rio_t/factors/state_block.h"
#include "rio_t/imu/buffer.h"

namespace rio_t {

/// Half of the time over which the derivative with respect to t_O averages the IMU [s]. A vibration at 8 Hz
/// and above hardly moves a radar and must not count as acceleration. Motion at 2 Hz, as of people, loses 13
/// % (docs/method.md, section 5.3).
constexpr double kOffsetHalfWidth = 0.1;
/// The same where the IMU vibrates: as long as it takes until the noise of the mean is below kMaxRateNoise
/// [m/s^2], which is half of the acceleration that tells an offset; but not longer than half a window.
constexpr double kMaxOffsetHalfWidth = 0.5;
constexpr double kMaxRateNoise = 0.1;

/// Half of the time over which the derivative averages the IMU at `time` [s].
double offsetHalfWidth(const ImuBuffer& imu, Time time);

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
/// The same for a state `x` at the time of measurement `tau`; `g_W` is gravity in W [m/s^2].
VelocityRate velocityRate(const ImuBuffer& imu, Time tau, const StateBlock& x, const Eigen::Vector3d& g_W,
                          const Eigen::Vector3d& l_I);

}  // namespace rio_t
