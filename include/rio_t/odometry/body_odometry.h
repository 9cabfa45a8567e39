#pragma once

#include <Eigen/Geometry>

#include "rio_t/core/pose.h"
#include "rio_t/odometry/navigation_state.h"

namespace rio_t {

using Covariance6 = Eigen::Matrix<double, 6, 6>;

/// T_BI, the pose of the IMU in the body whose odometry is wanted: x_B = R_BI x_I + p_B. The default is a
/// body that is the IMU.
struct ImuInBody {
  Eigen::Vector3d p_B = Eigen::Vector3d::Zero();             ///< origin of I in B [m]
  Eigen::Quaterniond q_BI = Eigen::Quaterniond::Identity();  ///< turns I into B

  /// Origin of B in I [m].
  Eigen::Vector3d bodyOrigin_I() const { return -(q_BI.conjugate() * p_B); }
};

/// Motion of the body B in the odometry frame O, as nav_msgs/Odometry has it.
struct BodyOdometry {
  Time time;
  Eigen::Vector3d p_O = Eigen::Vector3d::Zero();             ///< origin of B in O [m]
  Eigen::Quaterniond q_OB = Eigen::Quaterniond::Identity();  ///< turns B into O
  Eigen::Vector3d v_B = Eigen::Vector3d::Zero();             ///< velocity of the origin of B, in B [m/s]
  Eigen::Vector3d omega_B = Eigen::Vector3d::Zero();         ///< angular velocity of B, in B [rad/s]
  /// The covariance of the position, then of a turn about the fixed axes of O [m^2, rad^2].
  Covariance6 pose_covariance = Covariance6::Zero();
  Covariance6 twist_covariance = Covariance6::Zero();  ///< of v_B, then of omega_B [m^2/s^2, rad^2/s^2]
};

/// T_OW, the place of the estimator's world W in the odometry frame O. Both have z up, so W is turned about z
/// and shifted. The default is O = W.
struct WorldInOdom {
  Eigen::Vector3d p_O = Eigen::Vector3d::Zero();             ///< origin of W in O [m]
  Eigen::Quaterniond q_OW = Eigen::Quaterniond::Identity();  ///< a turn about z
  /// Covariance of T_OW: of the position of `anchor_O` [m], then of the yaw [rad].
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  Eigen::Vector3d anchor_O = Eigen::Vector3d::Zero();  ///< an error of the yaw turns W about this point [m]
};

/// Places W so that the body, whose IMU starts at `start`, has the position and the yaw of `last`. Roll and
/// pitch are those of `start`, since gravity shows them. The uncertainty of `last` stays. With a
/// default-constructed `last`, the body begins at the origin of O with yaw zero. If the body hangs upside
/// down, the yaw is not defined, and W keeps its own.
WorldInOdom placeWorld(const StampedPose& start, const ImuInBody& T_BI, const BodyOdometry& last = {});

/// The odometry of a body that is fixed to the IMU. `rate_sigma`: white noise of a gyro sample [rad/s].
///
/// With l = origin of B in I: p_B = p_I + R_WI l, v_B = R_BI (R_WI' v_W + omega x l), omega_B = R_BI omega.
/// The covariances follow with the derivatives of these (docs/frames.md).
BodyOdometry bodyOdometry(const NavigationState& state, double rate_sigma, const ImuInBody& T_BI = {},
                          const WorldInOdom& T_OW = {});

}  // namespace rio_t
