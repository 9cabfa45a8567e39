#include "rio_t/imu/input_check.h"

#include <algorithm>
#include <cmath>

namespace rio_t {
namespace {

/// [m/s^2] 200 g: no IMU for navigation reads more.
constexpr double kImpossibleAcceleration = 2000.0;
/// [ranges] No IMU reads more than twice its range. The configured range may be rounded.
constexpr double kImpossibleShareOfRange = 2.0;

void raise(double& variance, double density) { variance = std::max(variance, density * density); }

}  // namespace

const char* faultOfValues(const ImuMeasurement& imu, const ImuInputCheckOptions& options) {
  if (!imu.angular_velocity.allFinite() || !imu.acceleration.allFinite()) return "imu_not_finite";
  const double most =
      options.accel_range > 0.0 ? kImpossibleShareOfRange * options.accel_range : kImpossibleAcceleration;
  // The check for a stuck axis replaces such a reading of the gyro.
  return imu.acceleration.cwiseAbs().maxCoeff() > most ? "imu_not_plausible" : nullptr;
}

ImuInputCheck::ImuInputCheck(double max_gap, const ImuInputCheckOptions& options)
    : max_gap_(max_gap),
      options_(options),
      stamps_(options.max_bridged_gap, options.jump_patience),
      saturation_(options.accel_range, options.gyro_range) {}

ImuInputCheck::Verdict ImuInputCheck::check(ImuMeasurement& imu) {
  if (const char* fault = faultOfValues(imu, options_)) return {Decision::kDrop, {fault}};
  Verdict verdict;
  std::optional<Time> before = stamps_.newest();
  switch (stamps_.check(imu.time)) {
    case ClockJumpDetector::Verdict::kGood:
      break;
    case ClockJumpDetector::Verdict::kBehind:
      return {Decision::kDrop, {"imu_out_of_order"}};
    case ClockJumpDetector::Verdict::kAhead:
      return {Decision::kDrop, {"imu_stamp_jump"}};
    case ClockJumpDetector::Verdict::kRestart:
      verdict = {Decision::kRestart, {"imu_clock_restart"}};
      before.reset();
      bridge_.reset();
      gyro_axes_ = {};
      accel_noise_.interrupt();
      gyro_noise_.interrupt();
      break;
  }
  const double gap = before ? imu.time - *before : 0.0;
  if (gap > max_gap_) {
    verdict.faults.push_back("imu_gap");
    const double share = std::min(1.0, gap / kMotionCorrelationTime);
    raise(imu.unseen_gyro_variance, share * options_.unseen_gyro_density);
    raise(imu.unseen_accel_variance, share * options_.unseen_accel_density);
  }
  // The interval before and the one after a saturated sample both hide something.
  const SaturationDetector::Saturated saturated = saturation_.check(imu);
  if (saturated.accel || saturated.gyro) verdict.faults.push_back("imu_saturated");
  if (saturated.gyro || was_saturated_.gyro) raise(imu.unseen_gyro_variance, options_.unseen_gyro_density);
  if (saturated.accel || was_saturated_.accel)
    raise(imu.unseen_accel_variance, options_.unseen_accel_density);
  was_saturated_ = saturated;
  const bool is_stuck = replaceStuck(imu);
  if (is_stuck) {
    verdict.faults.push_back("imu_stuck");
    raise(imu.unseen_gyro_variance, options_.unseen_gyro_density);
  }
  // Motion over a long gap would look like noise.
  if (saturated.accel || saturated.gyro || is_stuck || gap > kMotionCorrelationTime) {
    accel_noise_.interrupt();
    gyro_noise_.interrupt();
  } else {
    imu.unseen_accel_variance =
        std::max(imu.unseen_accel_variance, accel_noise_.add(imu.time, imu.acceleration));
    imu.unseen_gyro_variance =
        std::max(imu.unseen_gyro_variance, gyro_noise_.add(imu.time, imu.angular_velocity));
  }
  imu.accel_noise = accel_noise_.squaredDensity();
  imu.gyro_noise = gyro_noise_.squaredDensity();
  imu.accel_mean_noise = accel_noise_.squaredDensityOfMeans();
  imu.gyro_mean_noise = gyro_noise_.squaredDensityOfMeans();
  if (gap > max_gap_) verdict.bridge = bridge_.until(imu);
  bridge_.follow(imu);
  return verdict;
}

MeasuredImuNoise ImuInputCheck::noise() const {
  return {std::sqrt(accel_noise_.squaredDensity()), std::sqrt(gyro_noise_.squaredDensity())};
}

bool ImuInputCheck::replaceStuck(ImuMeasurement& imu) {
  bool is_stuck = false;
  for (int k = 0; k < 3; ++k) {
    const std::optional<double> likely =
        gyro_axes_[static_cast<std::size_t>(k)].check(imu.time, imu.angular_velocity[k]);
    if (!likely) continue;
    imu.angular_velocity[k] = *likely;
    is_stuck = true;
  }
  return is_stuck;
}

}  // namespace rio_t
