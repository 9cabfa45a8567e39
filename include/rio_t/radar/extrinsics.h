#pragma once

#include <Eigen/Geometry>

#include "rio_t/core/so3.h"

namespace rio_t {

/// T_IR, the pose of the radar in the IMU frame, as every radar package gives it.
struct Extrinsics {
  Eigen::Vector3d l_I = Eigen::Vector3d::Zero();             ///< radar origin in I [m]
  Eigen::Quaterniond q_IR = Eigen::Quaterniond::Identity();  ///< turns R into I

  Eigen::Matrix3d R_RI() const { return q_IR.conjugate().toRotationMatrix(); }  ///< turns I into R
};

/// Turn about the axes of I [rad] from one mounting to another: q_IR(to) = Exp(turn) q_IR(from).
inline Eigen::Vector3d turnBetween(const Extrinsics& from, const Extrinsics& to) {
  return so3::log(to.q_IR * from.q_IR.conjugate());
}

}  // namespace rio_t
