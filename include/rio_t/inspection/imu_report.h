#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "rio_t/imu/units.h"

namespace rio_t {

/// The properties of an IMU, as a recording shows them. Values are in m/s^2 and rad/s, unless marked "as
/// written".
struct ImuReport {
  std::vector<ImuMeasurement> samples;  ///< those that are finite and do not repeat the one before
  std::size_t not_finite = 0;
  double written_norm = 0.0;  ///< median of |acceleration|, as written
  ImuUnits units;             ///< units in which the driver writes
  /// One sentence that says why they cannot be used; empty: they can.
  std::string acceleration_fault, rate_fault;

  bool rests_at_start = false;
  double rest = 0.0;                                            ///< [s] length of the rest
  double rest_begin = 0.0;                                      ///< [s] after the first sample
  Eigen::Vector3d rest_acceleration = Eigen::Vector3d::Zero();  ///< mean specific force
  Eigen::Vector3d rest_rate = Eigen::Vector3d::Zero();          ///< mean: the gyro's bias
  Eigen::Vector3d mean_acceleration = Eigen::Vector3d::Zero();  ///< of the whole recording

  double accel_density_quiet = 0.0;   ///< [m/s^2/sqrt(Hz)] white noise, in the quietest tenth of the seconds
  double accel_density_median = 0.0;  ///< in the median second: more if the frame vibrates
  double gyro_density_quiet = 0.0;    ///< [rad/s/sqrt(Hz)]
  double largest_acceleration = 0.0, largest_rate = 0.0;  ///< on one axis
  std::size_t saturated = 0;                              ///< samples at the end of the range
  std::size_t repeated = 0;  ///< samples with the values of the one before, although the IMU turns
};

/// `written`: as the driver writes them, in the order of time; times must rise.
ImuReport inspectImu(const std::vector<ImuMeasurement>& written);

}  // namespace rio_t
