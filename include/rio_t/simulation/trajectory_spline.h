#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "rio_t/evaluation/trajectory.h"

namespace rio_t::simulation {

/// Pose of the IMU frame I in W and its derivatives.
struct MotionState {
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();             ///< [m]
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero();             ///< [m/s]
  Eigen::Vector3d a_W = Eigen::Vector3d::Zero();             ///< [m/s^2], gravity not included
  Eigen::Quaterniond q_WI = Eigen::Quaterniond::Identity();  ///< turns I into W
  Eigen::Vector3d omega_I = Eigen::Vector3d::Zero();  ///< angular velocity of I against W, in I [rad/s]
};

/// A smooth motion through the poses of a trajectory.
///
/// Position and quaternion are one uniform B-spline of degree 5 in R^7; the quaternion is normalised where it
/// is read. All derivatives are analytic and everything up to the fourth one is continuous, so acceleration
/// and angular acceleration have no kinks. The fit is linear: least squares over the poses plus a penalty on
/// the third derivative, which acts as the zero-phase low-pass 1 / (1 + (f / cutoff)^6) (Eilers and Marx,
/// "Flexible Smoothing with B-splines and Penalties", 1996).
class TrajectorySpline {
 public:
  static constexpr double kKnotSpacing = 0.05;  ///< [s]
  static constexpr double kUsualCutoff = 5.0;   ///< [Hz]

  /// `cutoff`: half-power frequency of the smoothing [Hz]. It removes faster motion, such as the noise of
  /// motion capture. Throws std::invalid_argument for fewer than four poses, stamps that do not increase, a
  /// cutoff that is not positive, or neighbouring poses more than 90 degrees apart.
  explicit TrajectorySpline(const Trajectory& poses, double cutoff = kUsualCutoff);

  /// Seconds from the first to the last pose.
  double duration() const { return duration_; }
  /// At `t` seconds after the first pose, 0 <= t <= duration (1 us of grace); else throws std::out_of_range.
  MotionState at(double t) const;

  /// RMS distance of the given poses from the spline.
  double positionResidual() const { return position_residual_; }  ///< [m]
  double rotationResidual() const { return rotation_residual_; }  ///< [rad]

 private:
  // All read-only after construction.
  double duration_ = 0.0;
  Eigen::Matrix<double, 7, Eigen::Dynamic> coefficients_;  // p_W, then q_WI as x y z w
  double position_residual_ = 0.0;
  double rotation_residual_ = 0.0;
};

}  // namespace rio_t::simulation
