#pragma once

#include <algorithm>
#include <cmath>

#include "rio_t/imu/measurement.h"

namespace rio_t {

/// Correlation time of rate of turn and acceleration [s]. The autocorrelation of the gyros of a hand-held rig
/// falls to 1/e in 0.5 to 0.7 s.
constexpr double kMotionCorrelationTime = 0.5;

/// Continuous-time noise of the IMU.
struct ImuNoise {
  /// [m/s^2/sqrt(Hz)] Ten times the white noise of an ADIS16448 at rest. It also stands for vibration, scale
  /// factor and misalignment; on a walking platform these are some 0.1 m/s^2 that last for a second.
  double accel_density = 2.0e-2;
  double gyro_density = 2.0e-4;       ///< [rad/s/sqrt(Hz)]
  double accel_random_walk = 1.0e-4;  ///< [m/s^3/sqrt(Hz)]
  double gyro_random_walk = 4.0e-6;   ///< [rad/s^2/sqrt(Hz)]
  double gyro_scale_error = 0.0;      ///< sigma of the gyro's scale, as a share of the rate

  /// Multiplies the variance of the accelerometer by `model_error_scale`, see ModelErrorScale.
  ImuNoise scaled(double model_error_scale) const {
    ImuNoise noise = *this;
    noise.accel_density *= std::sqrt(model_error_scale);
    return noise;
  }

  /// Squared densities of integrated samples for the interval that ends with `imu`: the larger of option and
  /// measurement, plus the unseen motion and, for the gyro, the error of its scale. On a vibrating frame an
  /// IMU is noisier than its data sheet says.
  double accelVariance(const ImuMeasurement& imu) const {
    return std::max(accel_density * accel_density, imu.accel_mean_noise) + imu.unseen_accel_variance;
  }
  double gyroVariance(const ImuMeasurement& imu) const {
    const double wrong_rate = gyro_scale_error * imu.angular_velocity.norm();
    return std::max(gyro_density * gyro_density, imu.gyro_mean_noise) + imu.unseen_gyro_variance +
           wrong_rate * wrong_rate * kMotionCorrelationTime;
  }
};

}  // namespace rio_t
