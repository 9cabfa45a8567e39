#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "rio_t/imu/measurement.h"
#include "rio_t/imu/noise.h"
#include "rio_t/simulation/motion.h"

namespace rio_t::simulation {

/// The noise of an ADIS16448 as measured on a real bag. Fixed here, apart from the defaults of the estimator:
/// what the estimator is configured to expect may be tuned, and the simulated world must not change with it.
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
  /// a sample gets density * sqrt(rate); a bias walks by random_walk / sqrt(rate) a sample;
  /// the scale of each axis of the gyro is drawn once
  ImuNoise noise = measuredImuNoise();
  /// Biases at the start; drawn from the sigmas where not given.
  std::optional<Eigen::Vector3d> accel_bias;  ///< [m/s^2]
  std::optional<Eigen::Vector3d> gyro_bias;   ///< [rad/s]
  double accel_bias_sigma = 0.05;             ///< [m/s^2] per axis
  double gyro_bias_sigma = 0.003;             ///< [rad/s] per axis
  double accel_saturation = 176.5;            ///< [m/s^2] per axis (18 g, ADIS16448)
  double gyro_saturation = 17.45;             ///< [rad/s] per axis (1000 deg/s)
  double gravity = 9.81;                      ///< [m/s^2]
  /// What a vibrating frame adds to every sample, at rest too, each axis on its own. The radar feels nothing.
  double accel_vibration = 0.0;  ///< [m/s^2] sigma per axis and sample
  double gyro_vibration = 0.0;   ///< [rad/s] sigma per axis and sample
  /// [Hz] 0: white from sample to sample. Above: a line 0.6 Hz wide there, as a motor makes it; amplitude and
  /// phase hold for half a second. Above half the rate it aliases: there is no filter.
  double vibration_frequency = 0.0;
  double dropout_share = 0.0;  ///< of the samples but the first: taken, never delivered

  /// No noise, no vibration, no bias and no lost samples; rate, saturation and gravity stay.
  void removeErrors();
};

struct ImuData {
  std::vector<ImuMeasurement> samples;
  /// True biases of each sample, in I.
  std::vector<Eigen::Vector3d> b_a;  ///< [m/s^2]
  std::vector<Eigen::Vector3d> b_g;  ///< [rad/s]
};

/// Samples of an IMU carried along `motion`: values of the instant of their stamp, not averages over the
/// interval. Stamps count from `start` (the start of the motion) and lie on whole nanoseconds. Throws
/// std::invalid_argument for options out of range.
ImuData simulateImu(const Motion& motion, const ImuModelOptions& options, std::uint64_t seed, Time start);

}  // namespace rio_t::simulation
