#pragma once

#include <Eigen/Geometry>

#include "rio_t/imu/buffer.h"
#include "rio_t/imu/noise.h"

namespace rio_t {

/// Motion between two times from the IMU alone, free of the state it starts from, with bias Jacobians.
///
/// Forster et al., TRO 2017, eq. (33) with midpoint rotation instead of Euler; T is the time, g the gravity:
///   R_j = R_i dR,   v_j = v_i + g T + R_i dv,   p_j = p_i + v_i T + g T^2 / 2 + R_i dp.
/// Steps with dt < 0 integrate backwards.
struct ImuDelta {
  double dt = 0.0;                                         ///< T [s]
  Eigen::Quaterniond dR = Eigen::Quaterniond::Identity();  ///< R_i^T R_j
  Eigen::Vector3d dv = Eigen::Vector3d::Zero();            ///< in I_i [m/s]
  Eigen::Vector3d dp = Eigen::Vector3d::Zero();            ///< in I_i [m]
  Eigen::Matrix3d dR_dbg = Eigen::Matrix3d::Zero();        ///< dR(b + d) = dR(b) Exp(dR_dbg d)
  Eigen::Matrix3d dv_dbg = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d dv_dba = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d dp_dbg = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d dp_dba = Eigen::Matrix3d::Zero();

  /// One step with constant rates, biases removed: `omega` [rad/s] and `a` [m/s^2], in I.
  void step(double step_dt, const Eigen::Vector3d& omega, const Eigen::Vector3d& a);
};

/// Integrates the IMU from `from` to `to`, forwards or backwards, at these biases, without covariance.
ImuDelta integrate(const ImuBuffer& imu, Time from, Time to, const Eigen::Vector3d& b_g,
                   const Eigen::Vector3d& b_a);

/// ImuDelta between two times with its covariance, at the biases it was integrated with.
struct Preintegration {
  Eigen::Vector3d b_g = Eigen::Vector3d::Zero();  ///< [rad/s] linearisation point
  Eigen::Vector3d b_a = Eigen::Vector3d::Zero();  ///< [m/s^2] linearisation point
  ImuDelta delta;
  /// The errors are those of dR (right perturbation), dp, dv, in this order; Forster eq. (59)-(63).
  Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();
};

/// The same with covariance, for `to` later than `from`. `buffer` must cover both.
Preintegration preintegrate(const ImuBuffer& buffer, Time from, Time to, const Eigen::Vector3d& b_g,
                            const Eigen::Vector3d& b_a, const ImuNoise& noise);

}  // namespace rio_t
