#pragma once

#include <Eigen/Geometry>

#include "rio_t/core/time.h"

namespace rio_t {

/// Pose of the IMU frame I in the world frame W (z up) at a time.
struct StampedPose {
  Time time;
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();             ///< origin of I in W [m]
  Eigen::Quaterniond q_WI = Eigen::Quaterniond::Identity();  ///< turns I into W
};

}  // namespace rio_t
