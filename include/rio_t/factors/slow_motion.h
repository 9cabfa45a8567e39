#pragma once

#include <Eigen/Core>

#include "rio_t/radar/extrinsics.h"

namespace rio_t {

/// Mean motion around a scan, for the derivatives with respect to the mounting (docs/method.md, section 5.8).
///
/// The estimated velocity and the gyro hold noise that changes from scan to scan. In a derivative this noise
/// looks like motion that shows the mounting, and the factor would take it for information.
struct SlowMotion {
  Extrinsics T_IR;                                    ///< mounting from which the factor is linear
  Eigen::Vector3d v_R = Eigen::Vector3d::Zero();      ///< velocity of the radar, in R [m/s]
  Eigen::Vector3d omega_I = Eigen::Vector3d::Zero();  ///< angular velocity of I, in I [rad/s]
  double omega_variance = 0.0;                        ///< of its noise, about each axis [rad^2/s^2]
};

}  // namespace rio_t
