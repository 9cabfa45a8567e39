#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "rio_t/imu/measurement.h"
#include "rio_t/imu/noise.h"
#include "rio_t/simulation/motion.h"

namespace rio_t::simulation {

/// The noise of an ADIS16448, measured on a real bag. It is not the default of the estimator: tuning the
/// estimator must not change the simulated world.
inline ImuNoise measuredImuNoise() {
  ImuNoise noise;
  noise.accel_density = 2.4e-3;
  noise.gyro_density = 2.0e-4;
  noise.accel_random_walk = 1.0e-4;
  noise.gyro_random_walk = 4.0e-6;
  return noise;
}

struct ImuModelOptions {
  double rate = 409.0;  ///< [Hz]
  /// The noise of a sample is density * sqrt(rate). A bias walks by random_walk / sqrt(rate) a sample. The
  /// scale of each axis of the gyro is drawn once.
  ImuNoise noise = measuredImuNoise();
  /// Biases at the start. If not given, they are drawn with the sigmas.
  std::optional<Eigen::Vector3d> accel_bias;  ///< [m/s^2]
  std::optional<Eigen::Vector3d> gyro_bias;   ///< [rad/s]
  double accel_bias_sigma = 0.05;             ///< [m/s^2] per axis
  double gyro_bias_sigma = 0.003;             ///< [rad/s] per axis
  double accel_saturation = 176.5;            ///< [m/s^2] per axis (18 g, ADIS16448)
  double gyro_saturation = 17.45;             ///< [rad/s] per axis (1000 deg/s)
  double gravity = 9.81;                      ///< [m/s^2]
  /// A vibrating frame adds this to every sample, also at rest, on each axis independently. The radar is not
  /// affected.
  double accel_vibration = 0.0;  ///< [m/s^2] sigma per axis and sample
  double gyro_vibration = 0.0;   ///< [rad/s] sigma per axis and sample
  /// [Hz] 0: white noise. Else a line 0.6 Hz wide at this frequency, as a motor makes it; amplitude and phase
  /// hold for half a second. Above half the rate it aliases, since there is no filter.
  double vibration_frequency = 0.0;
  double dropout_share = 0.0;  ///< share of the samples that are lost; never the first

  /// Removes noise, vibration, bias and lost samples. Rate, saturation and gravity stay.
  void removeErrors();
};

struct ImuData {
  std::vector<ImuMeasurement> samples;
  /// True biases of each sample, in I.
  std::vector<Eigen::Vector3d> b_a;  ///< [m/s^2]
  std::vector<Eigen::Vector3d> b_g;  ///< [rad/s]
};

/// Simulates an IMU on `motion`. The values are those at the stamp, not averages over the interval. The
/// stamps count from `start` (the start of the motion) and lie on whole nanoseconds. Throws
/// std::invalid_argument for options out of range.
ImuData simulateImu(const Motion& motion, const ImuModelOptions& options, std::uint64_t seed, Time start);

}  // namespace rio_t::simulation
