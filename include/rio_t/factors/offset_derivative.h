#pragma once

#include <Eigen/Core>

#include "rio_t/factors/state_block.h"
#include "rio_t/imu/buffer.h"

namespace rio_t {

/// Half of the time over which the IMU is averaged for the derivative with respect to t_O [s]: what shakes at
/// 8 Hz and above hardly moves a radar, and must not count as acceleration. At 2 Hz, as people move, 13 % are
/// lost (docs/method.md, section 5.3).
constexpr double kOffsetHalfWidth = 0.1;

/// How the radar's velocity changes with the time of measurement, d/dtau, in I: what a change of t_O shows,
/// with the opposite sign (docs/method.md, eq. 18).
struct VelocityRate {
  Eigen::Vector3d a_I = Eigen::Vector3d::Zero();  ///< [m/s^2]
  double variance = 0.0;                          ///< per axis, of the IMU's noise in it [m^2/s^4]

  /// The platform accelerates beyond `min_acceleration` [m/s^2] and beyond what the IMU's noise makes of no
  /// acceleration, so that a scan says something about the offset.
  bool informsOffset(double min_acceleration) const;
  /// The part of `a_I` that is surely motion: two sigma less. A rate that just passes informsOffset was lifted there
  /// by its noise, and would claim more information than it has.
  Eigen::Vector3d known() const;
};

/// a_c - omega x v_I + alpha x l, from the mean of the IMU around the time of measurement. `v_I` [m/s] and
/// gravity `g_I` [m/s^2] are in I at that time, `l_I` is the radar in I [m].
VelocityRate velocityRate(const ImuMean& imu, const Eigen::Vector3d& b_g, const Eigen::Vector3d& b_a,
                          const Eigen::Vector3d& v_I, const Eigen::Vector3d& g_I, const Eigen::Vector3d& l_I);
/// The same for a state `x` at the time of measurement `tau`; `g_W` is gravity in W [m/s^2].
VelocityRate velocityRate(const ImuBuffer& imu, Time tau, const StateBlock& x, const Eigen::Vector3d& g_W,
                          const Eigen::Vector3d& l_I);

}  // namespace rio_t
