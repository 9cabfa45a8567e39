#pragma once

#include <Eigen/Geometry>

namespace rio_t {

/// A mounting in words: where the radar looks, seen from an IMU with x forward, y left, z up (REP-103). All
/// zero: the radar looks forward and stands upright. The radar turns first to its yaw, then about its own
/// left axis to its pitch, then about its own forward axis to its roll.
struct MountingAngles {
  double yaw = 0.0;    ///< [rad] to the left, -pi to pi
  double pitch = 0.0;  ///< [rad] up, -pi/2 to pi/2
  double roll = 0.0;   ///< [rad] right side down, -pi to pi
};

/// q_IR of a mounting. R has x right, y forward, z up.
Eigen::Quaterniond rotationOf(const MountingAngles& angles);
/// The inverse. If the radar looks straight up or down, yaw and roll are about the same axis: then roll is 0.
MountingAngles mountingOf(const Eigen::Quaterniond& q_IR);

/// Turns vectors with x right, y forward, z up into x forward, y left, z up: a quarter turn about z.
Eigen::Quaterniond fluFromRfu();

}  // namespace rio_t
