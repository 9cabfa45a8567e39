#pragma once

#include <Eigen/Geometry>

#include "rio_t/core/time.h"
#include "rio_t/imu/buffer.h"
#include "rio_t/smoother/fixed_lag_smoother.h"

namespace rio_t {

/// State of the platform as published at IMU rate.
struct NavigationState {
  Time time;
  Eigen::Quaterniond q_WI = Eigen::Quaterniond::Identity();    ///< turns I into W
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();               ///< origin of I in W [m]
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero();               ///< velocity of I in W, in W [m/s]
  Eigen::Vector3d b_g = Eigen::Vector3d::Zero();               ///< gyro bias, in I [rad/s]
  Eigen::Vector3d b_a = Eigen::Vector3d::Zero();               ///< accelerometer bias, in I [m/s^2]
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< of I, in I, bias removed [rad/s]
  StateCovariance covariance = StateCovariance::Zero();
};

/// The state at a node with its covariance; `imu` must cover its time.
NavigationState navigationState(const NodeEstimate& node, const StateCovariance& covariance,
                                const ImuBuffer& imu);

/// d(heading, p_W) / d(state): the turn about the vertical of W [rad], and the position [m].
Eigen::Matrix<double, 4, StateBlock::kTangent> poseInW(const Eigen::Quaterniond& q_WI);

/// A heading that is wrong by a radian also shortens the path and the velocity. Adds the variance of this
/// second-order error to the covariance (docs/method.md, eq. 34a).
void addHeadingCurvature(NavigationState& state);

}  // namespace rio_t
