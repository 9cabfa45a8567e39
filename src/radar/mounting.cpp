#include "rio_t/radar/mounting.h"

#include <cmath>

namespace rio_t {

Eigen::Quaterniond fluFromRfu() { return {std::sqrt(0.5), 0.0, 0.0, -std::sqrt(0.5)}; }

Eigen::Quaterniond rotationOf(const MountingAngles& angles) {
  using Eigen::AngleAxisd;
  using Eigen::Vector3d;
  // About the left axis a positive turn is down.
  const Eigen::Quaterniond q_I_flu = AngleAxisd(angles.yaw, Vector3d::UnitZ()) *
                                     AngleAxisd(-angles.pitch, Vector3d::UnitY()) *
                                     AngleAxisd(angles.roll, Vector3d::UnitX());
  return (q_I_flu * fluFromRfu()).normalized();
}

MountingAngles mountingOf(const Eigen::Quaterniond& q_IR) {
  const Eigen::Matrix3d R = (q_IR * fluFromRfu().conjugate()).normalized().toRotationMatrix();
  const Eigen::Vector3d forward = R.col(0);
  const double level = std::hypot(forward.x(), forward.y());
  constexpr double kStraightUp = 1e-9;
  MountingAngles angles;
  angles.pitch = std::atan2(forward.z(), level);
  if (level < kStraightUp) {
    angles.yaw = std::atan2(-R(0, 1), R(1, 1));
    return angles;
  }
  angles.yaw = std::atan2(forward.y(), forward.x());
  angles.roll = std::atan2(R(2, 1), R(2, 2));
  return angles;
}

}  // namespace rio_t
