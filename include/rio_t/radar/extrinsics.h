#pragma once

#include <Eigen/Geometry>

namespace rio_t {

/// T_IR, the pose of the radar in the IMU frame, as every radar package gives it.
struct Extrinsics {
  Eigen::Vector3d l_I = Eigen::Vector3d::Zero();             ///< radar origin in I [m]
  Eigen::Quaterniond q_IR = Eigen::Quaterniond::Identity();  ///< turns R into I

  Eigen::Matrix3d R_RI() const { return q_IR.conjugate().toRotationMatrix(); }  ///< turns I into R
};

}  // namespace rio_t
