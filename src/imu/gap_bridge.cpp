#include "rio_t/imu/gap_bridge.h"

#include <algorithm>
#include <cmath>

#include "rio_t/core/so3.h"

namespace rio_t {
namespace {

constexpr double kStep = 0.02;        // [s] between samples that are made up
constexpr double kGravityTime = 1.5;  // [s] over which gravity is averaged: a few swings of the motion

/// sinh(a) / sinh(b) for 0 <= a <= b, b > 0. sinh() overflows from 711 on, which is a gap of six minutes.
double sinhRatio(double a, double b) { return std::exp(a - b) * std::expm1(-2.0 * a) / std::expm1(-2.0 * b); }

}  // namespace

void GapBridge::follow(const ImuMeasurement& imu) {
  if (newest_) {
    const double dt = imu.time - newest_->time;
    gravity_I_ = so3::exp(-dt * imu.angular_velocity) * gravity_I_;
    gravity_I_ += std::min(1.0, dt / kGravityTime) * (imu.acceleration - gravity_I_);
  } else {
    gravity_I_ = imu.acceleration;
  }
  newest_ = imu;
}

std::vector<ImuMeasurement> GapBridge::until(const ImuMeasurement& next) const {
  if (!newest_) return {};
  const double gap = next.time - newest_->time;
  const int steps = static_cast<int>(std::ceil(gap / kStep));
  const double dt = gap / steps;
  const double step = dt / kMotionCorrelationTime;
  const auto before = [&](int i) { return sinhRatio((steps - i) * step, steps * step); };
  const auto after = [&](int i) { return sinhRatio(i * step, steps * step); };

  // Turns gravity with the platform.
  std::vector<ImuMeasurement> bridge;
  ImuMeasurement imu = next;
  imu.is_bridge = true;
  imu.acceleration = gravity_I_;
  Eigen::Vector3d rate = newest_->angular_velocity;
  for (int i = 1; i <= steps; ++i) {
    imu.time = newest_->time + i * dt;
    imu.angular_velocity = before(i) * newest_->angular_velocity + after(i) * next.angular_velocity;
    imu.acceleration = so3::exp(-0.5 * dt * (rate + imu.angular_velocity)) * imu.acceleration;
    rate = imu.angular_velocity;
    bridge.push_back(imu);
  }
  const Eigen::Vector3d gravity_at_next = bridge.back().acceleration;
  bridge.pop_back();

  // Acceleration besides gravity. After a long gap `next` does not show it: the direction of gravity is
  // unknown by then.
  const Eigen::Vector3d motion_before = newest_->acceleration - gravity_I_;
  const Eigen::Vector3d motion_after =
      std::exp(-gap / kMotionCorrelationTime) * (next.acceleration - gravity_at_next);
  for (int i = 1; i < steps; ++i)
    bridge[static_cast<std::size_t>(i - 1)].acceleration +=
        before(i) * motion_before + after(i) * motion_after;
  return bridge;
}

}  // namespace rio_t
