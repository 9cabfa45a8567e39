#include "rio_t/imu/saturation_detector.h"

#include <algorithm>
#include <cmath>

namespace rio_t {
namespace {

constexpr int kFlatTop = 5;               // equal readings in a row
constexpr double kFarAcceleration = 0.5;  // [m/s^2] noise and coarse steps at rest stay below
constexpr double kFarAngularRate = 0.1;   // [rad/s] likewise
constexpr int kStretch = 200;             // over which a reading must be the largest, at least
constexpr double kShareOfRange = 0.999;   // of a range that was configured

}  // namespace

SaturationDetector::SaturationDetector(double accel_range, double gyro_range)
    : accel_range_(accel_range), gyro_range_(gyro_range) {}

SaturationDetector::Saturated SaturationDetector::check(const ImuMeasurement& imu) {
  Saturated saturated;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    // Each axis must see each sample.
    saturated.accel |= axes_[i].isSaturated(imu.acceleration[k], accel_range_, kFarAcceleration);
    saturated.gyro |= axes_[i + 3].isSaturated(imu.angular_velocity[k], gyro_range_, kFarAngularRate);
  }
  return saturated;
}

bool SaturationDetector::Axis::isSaturated(double reading, double range, double far_from_first) {
  const double size = std::abs(reading);
  if (range > 0.0) return size >= kShareOfRange * range;
  if (!first) first = reading;
  repeated = last && *last == reading ? repeated + 1 : 1;
  last = reading;
  if (limit && size > *limit) limit.reset();
  if (limit) return size == *limit;
  if (stretch++ == kStretch) {
    largest_before = largest;
    largest = 0.0;
    stretch = 0;
  }
  largest = std::max(largest, size);
  if (repeated < kFlatTop || size < std::max(largest, largest_before) ||
      std::abs(reading - *first) < far_from_first)
    return false;
  limit = size;
  return true;
}

}  // namespace rio_t
