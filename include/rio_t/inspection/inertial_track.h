#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "rio_t/imu/measurement.h"

namespace rio_t {

/// A recording of an IMU, integrated once. It answers questions about any two of its times.
///
/// G is the frame of the IMU at the first sample, which the gyro carries on. It drifts with the gyro, so only
/// differences over some seconds are good.
class InertialTrack {
 public:
  /// `imu`: in the order of time; samples that are not later than the one before are left out. `gyro_bias` is
  /// subtracted [rad/s].
  InertialTrack(const std::vector<ImuMeasurement>& imu, const Eigen::Vector3d& gyro_bias);

  bool covers(Time time) const { return !times_.empty() && times_.front() <= time && time <= times_.back(); }
  /// Whether there are samples all the way from `from` to `to`, with no gap above 0.2 s.
  bool isWhole(Time from, Time to) const;
  /// R_GI at a time that is covered.
  Eigen::Quaterniond rotation(Time time) const;
  /// Integral of the specific force in G up to a time that is covered [m/s].
  Eigen::Vector3d impulse(Time time) const;
  /// Mean angular velocity in I around a time, over 40 ms, as far as there are samples [rad/s].
  Eigen::Vector3d rate(Time time) const;
  /// Gravity in G [m/s^2]: the mean specific force over 15 s around a time, negated and scaled to `gravity`.
  /// Over so long a time the accelerations of the platform cancel.
  Eigen::Vector3d gravity(Time time, double gravity) const;

  Time begin() const { return times_.front(); }
  Time end() const { return times_.back(); }

 private:
  std::size_t before(Time time) const;  ///< index of the last sample that is not later

  std::vector<Time> times_;
  std::vector<Eigen::Quaterniond> q_GI_;
  std::vector<Eigen::Vector3d> impulse_;
  std::vector<std::size_t> gaps_;  ///< number of gaps up to each sample
};

}  // namespace rio_t
