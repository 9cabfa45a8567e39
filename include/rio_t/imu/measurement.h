#pragma once

#include <Eigen/Core>

#include "rio_t/core/time.h"

namespace rio_t {

/// One sample of the IMU, in the IMU frame I.
struct ImuMeasurement {
  Time time;
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< [rad/s], bias included
  /// Specific force [m/s^2], bias included: +g on the upward axis at rest.
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
};

}  // namespace rio_t
