#include "rio_t/inspection/inertial_track.h"

#include <algorithm>

#include "rio_t/core/so3.h"

namespace rio_t {
namespace {

constexpr double kGap = 0.2;           // [s]
constexpr double kRateWidth = 0.02;    // [s] to either side
constexpr double kGravityWidth = 7.5;  // [s] to either side

}  // namespace

InertialTrack::InertialTrack(const std::vector<ImuMeasurement>& imu, const Eigen::Vector3d& gyro_bias) {
  const ImuMeasurement* last = nullptr;
  for (const ImuMeasurement& sample : imu) {
    if (last != nullptr && sample.time <= last->time) continue;
    if (last == nullptr) {
      q_GI_.emplace_back(Eigen::Quaterniond::Identity());
      impulse_.emplace_back(Eigen::Vector3d::Zero());
      gaps_.push_back(0);
    } else {
      const double dt = sample.time - last->time;
      const Eigen::Vector3d half_turn =
          0.25 * dt * (last->angular_velocity + sample.angular_velocity - 2.0 * gyro_bias);
      const Eigen::Quaterniond middle = q_GI_.back() * so3::exp(half_turn);
      impulse_.emplace_back(impulse_.back() +
                            0.5 * dt * (middle * (last->acceleration + sample.acceleration)));
      q_GI_.push_back((middle * so3::exp(half_turn)).normalized());
      gaps_.push_back(gaps_.back() + (dt > kGap ? 1 : 0));
    }
    times_.push_back(sample.time);
    last = &sample;
  }
}

std::size_t InertialTrack::before(Time time) const {
  const auto after = std::upper_bound(times_.begin(), times_.end(), time);
  return after == times_.begin() ? 0 : static_cast<std::size_t>(after - times_.begin()) - 1;
}

bool InertialTrack::isWhole(Time from, Time to) const {
  if (!covers(from) || !covers(to)) return false;
  const std::size_t last = before(to);
  const std::size_t end = times_[last] < to ? last + 1 : last;
  return gaps_[before(from)] == gaps_[end];
}

Eigen::Quaterniond InertialTrack::rotation(Time time) const {
  const std::size_t i = before(time);
  if (i + 1 >= times_.size()) return q_GI_.back();
  const double share = (time - times_[i]) / (times_[i + 1] - times_[i]);
  return q_GI_[i].slerp(std::clamp(share, 0.0, 1.0), q_GI_[i + 1]);
}

Eigen::Vector3d InertialTrack::impulse(Time time) const {
  const std::size_t i = before(time);
  if (i + 1 >= times_.size()) return impulse_.back();
  const double share = std::clamp((time - times_[i]) / (times_[i + 1] - times_[i]), 0.0, 1.0);
  return impulse_[i] + share * (impulse_[i + 1] - impulse_[i]);
}

Eigen::Vector3d InertialTrack::rate(Time time) const {
  const Time from = std::clamp(time - kRateWidth, begin(), end());
  const Time to = std::clamp(time + kRateWidth, begin(), end());
  if (to <= from) return Eigen::Vector3d::Zero();
  return so3::log((rotation(from).conjugate() * rotation(to)).normalized()) / (to - from);
}

Eigen::Vector3d InertialTrack::gravity(Time time, double gravity) const {
  const Time from = std::clamp(time - kGravityWidth, begin(), end());
  const Time to = std::clamp(time + kGravityWidth, begin(), end());
  const Eigen::Vector3d sum = impulse(to) - impulse(from);
  return sum.norm() > 0.0 ? Eigen::Vector3d(-gravity * sum.normalized()) : Eigen::Vector3d::Zero();
}

}  // namespace rio_t
