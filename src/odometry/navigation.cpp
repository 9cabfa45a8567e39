#include "rio_t/odometry/navigation.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace rio_t {

Navigation::Navigation(const OdometryOptions& options, const Eigen::Vector3d& g_W)
    : imu_noise_(options.imu_noise),
      g_W_(g_W),
      input_check_(options.max_imu_gap, options.imu_input_check),
      propagator_(options.imu_noise, g_W) {}

Navigation::Checked Navigation::add(const ImuMeasurement& imu) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ImuMeasurement sample = imu;
  ImuInputCheck::Verdict verdict = input_check_.check(sample);
  Checked checked;
  checked.sample = std::move(verdict.sample);
  checked.faults = std::move(verdict.faults);
  if (checked.sample.is_restart) {
    propagator_ = ImuPropagator(imu_noise_, g_W_);
    ++clock_restarts_;
  }
  checked.clock_restarts = clock_restarts_;
  if (checked.sample.fault != nullptr) return checked;
  accel_noises_ += sample.accel_noise;
  gyro_noises_ += sample.gyro_noise;
  samples_ += 1.0;
  for (const ImuMeasurement& each : verdict.bridge) propagator_.add(each);
  const std::optional<NavigationState> before = sample.lost_time > 0.0 ? propagator_.state() : std::nullopt;
  if (before) sample.setUnseenDistance(before->time, before->v_W);
  propagator_.add(sample);
  checked.taken = std::move(verdict.bridge);
  checked.taken.push_back(sample);
  checked.state = propagator_.state();
  if (checked.state) addHeadingCurvature(*checked.state);
  return checked;
}

void Navigation::anchor(const NavigationState& state, bool at_rest, const ImuNoise& noise, Time oldest,
                        std::uint64_t clock_restarts) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (clock_restarts != clock_restarts_) return;
  propagator_.setNoise(noise);
  propagator_.anchor(state, at_rest);
  propagator_.dropBefore(oldest);
}

std::optional<NavigationState> Navigation::state() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return propagator_.state();
}

MeasuredImuNoise Navigation::imuNoise() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return input_check_.noise();
}

MeasuredImuNoise Navigation::imuNoiseOfRun() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const double count = std::max(1.0, samples_);
  return {std::sqrt(accel_noises_ / count), std::sqrt(gyro_noises_ / count)};
}

}  // namespace rio_t
