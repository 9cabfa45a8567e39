#pragma once

#include <Eigen/Core>
#include <cmath>

namespace rio_t {

// Directions in R (x right, y forward, z up). The azimuth is 0 forward and positive to the right, the
// elevation is positive up [rad].
inline double azimuthOf(const Eigen::Vector3d& p_R) { return std::atan2(p_R.x(), p_R.y()); }
inline double elevationOf(const Eigen::Vector3d& p_R) { return std::atan2(p_R.z(), p_R.head<2>().norm()); }
/// Unit vector of a direction.
inline Eigen::Vector3d directionOf(double azimuth, double elevation) {
  return {std::cos(elevation) * std::sin(azimuth), std::cos(elevation) * std::cos(azimuth),
          std::sin(elevation)};
}

}  // namespace rio_t
