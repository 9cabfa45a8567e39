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
  /// How well T_OW is known: of the position of `anchor_O` [m], then of the yaw [rad].
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  Eigen::Vector3d anchor_O = Eigen::Vector3d::Zero();  ///< the point about which the yaw is not known [m]
};

/// Places W so that the body, whose IMU starts at `start`, is where `last` says: at the same position, with
/// the same yaw. Roll and pitch are those of `start`, since gravity shows them. The uncertainty of `last`
/// stays. A default-constructed `last` lets O begin at the body: at the origin, turned from the axes of O by
/// roll and pitch alone. If the body hangs upside down, the yaw is not defined, and W keeps its own.
WorldInOdom placeWorld(const StampedPose& start, const ImuInBody& T_BI, const BodyOdometry& last = {});

/// The odometry of a body that is fixed to the IMU. `rate_sigma`: white noise of a gyro sample [rad/s].
///
/// With l = origin of B in I: p_B = p_I + R_WI l, v_B = R_BI (R_WI' v_W + omega x l), omega_B = R_BI omega.
/// The covariances follow with the derivatives of these (docs/frames.md).
BodyOdometry bodyOdometry(const NavigationState& state, double rate_sigma, const ImuInBody& T_BI = {},
                          const WorldInOdom& T_OW = {});

}  // namespace rio_t
