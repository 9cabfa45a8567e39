#pragma once

#include <Eigen/Core>

namespace rio_t {

/// Velocity expected before the scan, e.g. from the IMU.
struct VelocityPrior {
  Eigen::Vector3d v_R = Eigen::Vector3d::Zero();         ///< radar velocity, radar frame [m/s]
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< [m^2/s^2], positive definite
};

}  // namespace rio_t
