#pragma once

#include <Eigen/Core>

#include "rio_t/core/time.h"

namespace rio_t {

/// One sample of the IMU, in the IMU frame I.
struct ImuMeasurement {
  Time time;
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< [rad/s], bias included
  /// Specific force [m/s^2], bias included: +g on the upward axis at rest.
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();

  // Motion that the interval ending with this sample hides (a gap, saturated axes), as squared densities of
  // white noise per axis. They add to those of ImuNoise; see ImuInputCheck.
  double unseen_gyro_variance = 0.0;      ///< [rad^2/s]
  double unseen_accel_variance = 0.0;     ///< [m^2/s^3]
  double unseen_velocity_variance = 0.0;  ///< [m^2/s] of a velocity that only the position misses
  /// [s] of motion before this sample that no interval of stamps covers: the clock stepped back. The unseen
  /// variances contain what it may have changed.
  double lost_time = 0.0;
  /// Sets the unseen variance of the distance in the lost time. `before` is the time of the sample before,
  /// and `v_W` the velocity then.
  void setUnseenDistance(Time before, const Eigen::Vector3d& v_W) {
    unseen_velocity_variance = (lost_time * v_W).squaredNorm() / (time - before);
  }

  // White noise measured by NoiseSpectrum, as squared densities per axis: that of the samples, and what is
  // left of it in their means.
  double gyro_noise = 0.0;        ///< [rad^2/s]
  double accel_noise = 0.0;       ///< [m^2/s^3]
  double gyro_mean_noise = 0.0;   ///< [rad^2/s]
  double accel_mean_noise = 0.0;  ///< [m^2/s^3]

  bool is_bridge = false;  ///< not measured: see GapBridge
};

}  // namespace rio_t
