#include "rio_t/imu/buffer.h"

#include <algorithm>
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

std::size_t ImuBuffer::firstAfter(Time time) const {
  const auto it = std::upper_bound(samples_.begin(), samples_.end(), time,
                                   [](Time t, const ImuMeasurement& sample) { return t < sample.time; });
  return static_cast<std::size_t>(it - samples_.begin());
}

ImuMeasurement ImuBuffer::at(Time time) const {
  const std::size_t after = firstAfter(time);
  ImuMeasurement result;
  if (after == 0 || after == samples_.size()) {
    result = after == 0 ? samples_.front() : samples_.back();
  } else {
    const ImuMeasurement& a = samples_[after - 1];
    const ImuMeasurement& b = samples_[after];
    const double share = (time - a.time) / (b.time - a.time);
    result.angular_velocity = a.angular_velocity + share * (b.angular_velocity - a.angular_velocity);
    result.acceleration = a.acceleration + share * (b.acceleration - a.acceleration);
    result.gyro_doubt = b.gyro_doubt;
    result.accel_doubt = b.accel_doubt;
    result.is_bridge = a.is_bridge || b.is_bridge;
  }
  result.time = time;
  return result;
}

Eigen::Vector3d ImuBuffer::angularAcceleration(Time time, double half_width) const {
  const Time from = std::max(time - half_width, oldest());
  const Time to = std::min(time + half_width, newest());
  if (to <= from) return Eigen::Vector3d::Zero();
  return (at(to).angular_velocity - at(from).angular_velocity) / (to - from);
}

}  // namespace rio_t
