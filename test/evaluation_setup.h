#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <string>

#include "rio_t/core/so3.h"
#include "rio_t/core/time.h"
#include "rio_t/evaluation/errors.h"
#include "rio_t/evaluation/trajectory.h"

namespace rio_t {

constexpr double kExact = 1e-9;

inline Time at(double seconds) { return Time::fromNanoseconds(1700000000000000000) + seconds; }

inline StampedPose pose(double seconds, const Eigen::Vector3d& p_W, double yaw_deg = 0.0) {
  return {at(seconds), p_W, so3::exp({0.0, 0.0, yaw_deg * M_PI / 180.0})};
}

/// 1 m/s along a circle of 5 m radius that climbs a little, heading along the path, 10 Hz.
inline Trajectory helix(int poses = 101) {
  Trajectory trajectory;
  for (int i = 0; i < poses; ++i) {
    const double t = 0.1 * i;
    const double angle = t / 5.0;
    trajectory.push_back(
        pose(t, {5.0 * std::sin(angle), 5.0 * (1.0 - std::cos(angle)), 0.05 * t}, angle * 180.0 / M_PI));
  }
  return trajectory;
}

inline Trajectory moved(Trajectory trajectory, const Eigen::Quaterniond& q, const Eigen::Vector3d& t) {
  for (StampedPose& pose : trajectory) {
    pose.p_W = q * pose.p_W + t;
    pose.q_WI = q * pose.q_WI;
  }
  return trajectory;
}

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

inline std::string testData(const std::string& name) {
  return std::string(RIO_T_SOURCE_DIR) + "/test/data/" + name;
}

}  // namespace rio_t
