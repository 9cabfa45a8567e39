#include "rio_t/imu/buffer.h"

#include <algorithm>
#include <iterator>
#include <stdexcept>

namespace rio_t {

void ImuBuffer::add(const ImuMeasurement& imu) {
  if (!empty() && imu.time <= newest())
    throw std::invalid_argument("ImuBuffer: sample not later than the newest");
  samples_.push_back(imu);
}

void ImuBuffer::dropBefore(Time time) {
  while (samples_.size() > 1 && samples_[1].time <= time) samples_.pop_front();
}

ImuBuffer::Samples::const_iterator ImuBuffer::firstAfter(Time time) const {
  return std::upper_bound(samples_.begin(), samples_.end(), time,
                          [](Time t, const ImuMeasurement& sample) { return t < sample.time; });
}

ImuMeasurement ImuBuffer::interpolated(Samples::const_iterator after, Time time) const {
  ImuMeasurement result = after == samples_.end() ? samples_.back() : *after;
  if (after != samples_.begin() && after != samples_.end()) {
    const ImuMeasurement& a = *std::prev(after);
    const ImuMeasurement& b = *after;  // carries the noise of the interval
    const double share = (time - a.time) / (b.time - a.time);
    result.angular_velocity = a.angular_velocity + share * (b.angular_velocity - a.angular_velocity);
    result.acceleration = a.acceleration + share * (b.acceleration - a.acceleration);
    result.is_bridge = a.is_bridge || b.is_bridge;
  }
  result.time = time;
  return result;
}

ImuMean ImuBuffer::mean(Time time, double half_width) const {
  struct Half {
    Eigen::Vector3d gyro = Eigen::Vector3d::Zero();  // not weighted, as its duration
    double duration = 0.0;
  };
  ImuMean result;
  const Time middle = std::clamp(time, oldest(), newest());
  const double per_second = 1.0 / half_width;
  double weights = 0.0;
  double squared_weights = 0.0;
  const auto half = [&](Time from, Time to) {
    Half sums;
    const double reach = to - from;
    const bool rises = to == middle;
    forEachInterval(from, to, [&](double dt, const auto& gyro, const auto& accel, const auto& later) {
      const double away = rises ? reach - sums.duration - 0.5 * dt : sums.duration + 0.5 * dt;
      const double share = 1.0 - per_second * away;
      const double weight = share * dt;
      sums.gyro += dt * gyro;
      sums.duration += dt;
      result.angular_velocity += weight * gyro;
      result.acceleration += weight * accel;
      weights += weight;
      const double squared_weight = share * weight;
      squared_weights += squared_weight;
      result.gyro_variance += squared_weight * (later.gyro_noise + later.unseen_gyro_variance);
      result.accel_variance += squared_weight * (later.accel_noise + later.unseen_accel_variance);
    });
    return sums;
  };
  const Half before = half(std::max(middle - half_width, oldest()), middle);
  const Half after = half(middle, std::min(middle + half_width, newest()));
  if (weights <= 0.0) {
    const ImuMeasurement sample = at(time);
    result.angular_velocity = sample.angular_velocity;
    result.acceleration = sample.acceleration;
    return result;
  }
  result.angular_velocity /= weights;
  result.acceleration /= weights;
  result.gyro_variance /= squared_weights;
  result.accel_variance /= squared_weights;
  result.duration = weights * weights / squared_weights;
  if (before.duration > 0.0 && after.duration > 0.0) {
    result.half_duration = 0.5 * (before.duration + after.duration);
    result.angular_acceleration =
        (after.gyro / after.duration - before.gyro / before.duration) / result.half_duration;
  }
  return result;
}

}  // namespace rio_t
