#pragma once

#include <Eigen/Core>
#include <deque>

#include "rio_t/imu/measurement.h"

namespace rio_t {

/// Mean of the IMU around a time, in I, biases included. The weights fall linearly to zero on both sides.
struct ImuMean {
  double duration = 0.0;       ///< of an unweighted mean with the same noise [s]
  double half_duration = 0.0;  ///< mean length of both sides; 0 if there is only one [s]
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();      ///< [rad/s]
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();          ///< specific force [m/s^2]
  Eigen::Vector3d angular_acceleration = Eigen::Vector3d::Zero();  ///< [rad/s^2]
  /// Squared density of noise and unseen motion [rad^2/s]. Divided by `duration`: the variance of the mean.
  double gyro_variance = 0.0;
  double accel_variance = 0.0;  ///< likewise [m^2/s^3]
};

/// The recent IMU samples in time order, read as a piecewise linear signal.
class ImuBuffer {
 public:
  /// Throws std::invalid_argument if `imu` is not later than the newest sample.
  void add(const ImuMeasurement& imu);
  /// Drops samples before `time`, but keeps the one that interpolation at `time` needs.
  void dropBefore(Time time);
  void clear() { samples_.clear(); }

  bool empty() const { return samples_.empty(); }
  Time oldest() const { return samples_.front().time; }
  Time newest() const { return samples_.back().time; }
  bool covers(Time time) const { return !empty() && oldest() <= time && time <= newest(); }

  /// Linear interpolation; outside of the samples the nearest one, with `time` as its time. The buffer must
  /// not be empty.
  ImuMeasurement at(Time time) const { return interpolated(firstAfter(time), time); }

  /// Mean over [time - half_width, time + half_width], as far as there are samples. Not for an empty buffer.
  ImuMean mean(Time time, double half_width) const;

  /// Calls step(dt, angular_velocity, acceleration, later) for each interval between samples from `from` to
  /// `to`, with the mean readings of both ends. `later` is the later end, which has the noise of the
  /// interval. The ends at `from` and `to` are interpolated. Goes backwards with dt < 0 if `to` < `from`.
  template <typename Step>
  void forEachInterval(Time from, Time to, Step&& step) const;

  /// Calls visit(sample) for each sample later than `from` and not later than `to`.
  template <typename Visit>
  void forEachSample(Time from, Time to, Visit&& visit) const {
    for (auto sample = firstAfter(from); sample != samples_.end() && sample->time <= to; ++sample)
      visit(*sample);
  }

 private:
  using Samples = std::deque<ImuMeasurement>;
  Samples::const_iterator firstAfter(Time time) const;  ///< the first sample later than `time`
  /// As `at`. `after` is firstAfter(time).
  ImuMeasurement interpolated(Samples::const_iterator after, Time time) const;

  Samples samples_;
};

template <typename Step>
void ImuBuffer::forEachInterval(Time from, Time to, Step&& step) const {
  if (empty() || from == to) return;
  const auto interval = [&](const ImuMeasurement& a, const ImuMeasurement& b) {
    const double dt = b.time - a.time;
    if (dt == 0.0) return;
    const Eigen::Vector3d gyro = 0.5 * (a.angular_velocity + b.angular_velocity);
    const Eigen::Vector3d accel = 0.5 * (a.acceleration + b.acceleration);
    step(dt, gyro, accel, dt > 0.0 ? b : a);
  };
  auto sample = firstAfter(from);
  const ImuMeasurement first = interpolated(sample, from);
  const ImuMeasurement* previous = &first;
  const auto advance = [&](const ImuMeasurement& next) {
    interval(*previous, next);
    previous = &next;
  };
  if (from < to) {
    for (; sample != samples_.end() && sample->time < to; ++sample) advance(*sample);
  } else {
    while (sample != samples_.begin() && (--sample)->time > to) advance(*sample);
  }
  interval(*previous, at(to));
}

}  // namespace rio_t
