#pragma once

#include <ceres/sized_cost_function.h>

#include <Eigen/Geometry>
#include <optional>

#include "rio_t/core/time.h"
#include "rio_t/factors/state_block.h"
#include "rio_t/imu/buffer.h"
#include "rio_t/imu/measurement.h"

namespace rio_t {

/// One ego-velocity of the radar, as the factors need it.
struct RadarVelocityMeasurement {
  Time stamp;                                                ///< measured at stamp - t_O
  Eigen::Vector3d v_R = Eigen::Vector3d::Zero();             ///< radar velocity, in R [m/s]
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  ///< in R [m^2/s^2]
  Eigen::Matrix3d R_RI = Eigen::Matrix3d::Identity();        ///< turns I into R
  Eigen::Vector3d l_I = Eigen::Vector3d::Zero();             ///< radar origin in I [m]
  /// Set: the scan says nothing of the offset (VelocityRate::informsOffset), and the factor takes this value
  /// for it [s], whatever t_O is. At constant velocity the derivative with respect to t_O is noise of the
  /// IMU, and a thousand scans of it would pass for knowledge.
  std::optional<double> held_t_O = std::nullopt;
};

/// The paper's model, eq. (4)-(5) (docs/method.md, eq. 13): one acceleration stands for the whole shift.
/// Blocks: state at the stamp, t_O.
///   h = R_RI (R_IW v_W + (omega - b_g) x l - t_O a_c),   a_c = a - b_a + R_IW g_W,
/// with omega at the stamp, and for a the mean over 2 kOffsetHalfWidth around it. Residual: h - z, whitened.
class ConstantAccelerationRadarFactor final : public ceres::SizedCostFunction<3, StateBlock::kSize, 1> {
 public:
  ConstantAccelerationRadarFactor(const RadarVelocityMeasurement& z, const ImuBuffer& imu,
                                  const Eigen::Vector3d& g_W) {
    set(z, imu, g_W);
  }
  /// As if made anew.
  void set(const RadarVelocityMeasurement& z, const ImuBuffer& imu, const Eigen::Vector3d& g_W);
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  RadarVelocityMeasurement z_;
  ImuMeasurement imu_;
  Eigen::Vector3d g_W_;
  Eigen::Matrix3d whitening_;
};

/// The IMU itself over the shift (docs/method.md, eq. 14-18). Blocks: state at `state_time`, t_O.
///   h = R_RI [ dR^T (R_IW (v_W + g_W T) + dv) + (omega(tau) - b_g) x l ],   tau = stamp - t_O,   T = tau -
///   state_time,
/// where dR, dv integrate the IMU from the state to tau, forwards or backwards, at the current biases. Exact
/// for any shift that the IMU covers; the nearer the state is to tau, the cheaper. Residual: h - z, whitened.
/// `imu` must outlive the factor and keep the samples between state_time and stamp -+ max_time_offset.
class ImuRadarFactor final : public ceres::SizedCostFunction<3, StateBlock::kSize, 1> {
 public:
  ImuRadarFactor(const RadarVelocityMeasurement& z, Time state_time, const ImuBuffer& imu,
                 double max_time_offset, const Eigen::Vector3d& g_W) {
    set(z, state_time, imu, max_time_offset, g_W);
  }
  /// As if made anew.
  void set(const RadarVelocityMeasurement& z, Time state_time, const ImuBuffer& imu, double max_time_offset,
           const Eigen::Vector3d& g_W);
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  RadarVelocityMeasurement z_;
  Time state_time_;
  const ImuBuffer* imu_ = nullptr;
  double max_time_offset_ = 0.0;
  Eigen::Vector3d g_W_;
  Eigen::Matrix3d whitening_;
};

}  // namespace rio_t
