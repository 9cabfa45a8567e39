#pragma once

namespace rio_t {

/// Continuous-time noise of the IMU.
struct ImuNoise {
  double accel_density = 2.4e-3;      ///< [m/s^2/sqrt(Hz)]
  double gyro_density = 2.0e-4;       ///< [rad/s/sqrt(Hz)]
  double accel_random_walk = 1.0e-4;  ///< [m/s^3/sqrt(Hz)]
  double gyro_random_walk = 4.0e-6;   ///< [rad/s^2/sqrt(Hz)]
};

}  // namespace rio_t
