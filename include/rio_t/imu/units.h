#pragma once

#include "rio_t/core/angle.h"
#include "rio_t/imu/measurement.h"

namespace rio_t {

/// Units that an IMU driver writes. sensor_msgs/Imu asks for m/s^2 and rad/s, and not every driver does so.
enum class AccelerationUnit {
  kMetresPerSecondSquared,  ///< "m/s2"
  kStandardGravity,         ///< "g": 9.80665 m/s^2
};
enum class RateUnit {
  kRadiansPerSecond,  ///< "rad/s"
  kDegreesPerSecond,  ///< "deg/s"
};

struct ImuUnits {
  AccelerationUnit acceleration = AccelerationUnit::kMetresPerSecondSquared;
  RateUnit rate = RateUnit::kRadiansPerSecond;
};

/// [m/s^2] in one unit.
inline double inMetresPerSecondSquared(AccelerationUnit unit) {
  return unit == AccelerationUnit::kStandardGravity ? 9.80665 : 1.0;
}
/// [rad/s] in one unit.
inline double inRadiansPerSecond(RateUnit unit) {
  return unit == RateUnit::kDegreesPerSecond ? kDegree : 1.0;
}

/// A sample as the driver wrote it, in m/s^2 and rad/s.
inline ImuMeasurement converted(ImuMeasurement imu, const ImuUnits& units) {
  imu.acceleration *= inMetresPerSecondSquared(units.acceleration);
  imu.angular_velocity *= inRadiansPerSecond(units.rate);
  return imu;
}

}  // namespace rio_t
