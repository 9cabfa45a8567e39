#include "rio_t/imu/saturation_detector.h"

#include <algorithm>
#include <cmath>

namespace rio_t {
namespace {

constexpr int kFlatTop = 5;               // equal readings in a row
constexpr double kFarAcceleration = 0.5;  // [m/s^2] noise and coarse steps at rest stay below
constexpr double kFarAngularRate = 0.1;   // [rad/s] likewise
constexpr double kStretch = 1.0;  // [s] A flat top is the largest reading of at least this time: some swings
constexpr double kShareOfRange = 0.999;  // of a configured range: from here on, a reading is saturated
/// [smallest steps of the axis] A flat top is reached by at least this step. The smooth top of a swing that
/// repeats a reading five times is reached by one smallest step, and by a few with noise.
constexpr double kSteep = 6.0;

}  // namespace

SaturationDetector::SaturationDetector(double accel_range, double gyro_range)
    : accel_range_(accel_range), gyro_range_(gyro_range) {}

SaturationDetector::Saturated SaturationDetector::check(const ImuMeasurement& imu) {
  Saturated saturated;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    // Each axis must see each sample.
    saturated.accel |= axes_[i].isSaturated(imu.time, imu.acceleration[k], accel_range_, kFarAcceleration);
    saturated.gyro |=
        axes_[i + 3].isSaturated(imu.time, imu.angular_velocity[k], gyro_range_, kFarAngularRate);
  }
  return saturated;
}

bool SaturationDetector::Axis::isSaturated(Time time, double reading, double range, double far_from_first) {
  const double size = std::abs(reading);
  if (range > 0.0) return size >= kShareOfRange * range;
  if (!first) first = reading;
  follow(reading);
  if (limit && size > *limit) limit.reset();
  if (limit) return size == *limit;
  if (std::abs(time - stretch_since) >= kStretch) {  // the clock may jump, too
    largest_before = largest;
    largest = 0.0;
    stretch_since = time;
  }
  largest = std::max(largest, size);
  if (repeated < kFlatTop || !is_steep || size < std::max(largest, largest_before) ||
      std::abs(reading - *first) < far_from_first)
    return false;
  limit = size;
  return true;
}

void SaturationDetector::Axis::follow(double reading) {
  const double step = last ? std::abs(reading - *last) : 0.0;
  last = reading;
  if (step == 0.0) {
    ++repeated;
    return;
  }
  repeated = 1;
  is_steep = !smallest_step || step >= kSteep * *smallest_step;
  smallest_step = std::min(step, smallest_step.value_or(step));
}

}  // namespace rio_t
