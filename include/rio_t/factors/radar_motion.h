#pragma once

#include <Eigen/Core>
#include <array>

#include "rio_t/core/time.h"
#include "rio_t/factors/state_block.h"
#include "rio_t/imu/buffer.h"

namespace rio_t {

/// Half widths of the means of the IMU in the derivative with respect to t_O [s]. A vibration at 8 Hz and
/// above hardly moves a radar and must not count as acceleration. The first mean damps motion at 2 Hz, as of
/// people, by 13 % (docs/method.md, section 5.3). The wider ones are for an IMU that vibrates.
constexpr std::array<double, 3> kOffsetHalfWidths = {0.1, 0.2, 0.4};
constexpr double kOffsetHalfWidth = kOffsetHalfWidths.front();
constexpr double kMaxOffsetHalfWidth = kOffsetHalfWidths.back();

/// Derivative of the radar's velocity with respect to the time of measurement, d/dtau, in I. The derivative
/// with respect to t_O has the opposite sign (docs/method.md, eq. 18).
struct VelocityRate {
  Eigen::Vector3d a_I = Eigen::Vector3d::Zero();  ///< [m/s^2]
  double variance = 0.0;                          ///< of the IMU's noise in a_I, per axis [m^2/s^4]
};

/// a_c - omega x v_I + alpha x l, from the mean of the IMU around the time of measurement. `v_I` [m/s] and
/// gravity `g_I` [m/s^2] are in I at that time, `l_I` is the radar in I [m].
VelocityRate velocityRate(const ImuMean& imu, const Eigen::Vector3d& b_g, const Eigen::Vector3d& b_a,
                          const Eigen::Vector3d& v_I, const Eigen::Vector3d& g_I, const Eigen::Vector3d& l_I);

/// How the model accounts for the time between stamp and measurement.
enum class TimeOffsetModel {
  kConstantAcceleration,  ///< the paper's eq. (4)-(5): one acceleration times t_O; states at the stamps
  kImu,                   ///< the IMU itself over the shift; states at the estimated measurement times
};

/// Motion of the radar at the time of measurement of a scan, and how it depends on the state and on t_O.
/// The velocity of a scan and the Doppler of a point are projections of it.
struct RadarMotion {
  Eigen::Vector3d v_I = Eigen::Vector3d::Zero();  ///< velocity of the radar's origin, in I at that time [m/s]
  MotionJacobian<3> J_motion = MotionJacobian<3>::Zero();  ///< of v_I
  BiasJacobian<3> J_biases = BiasJacobian<3>::Zero();      ///< of v_I
  Eigen::Vector3d dv_dt_O = Eigen::Vector3d::Zero();       ///< of v_I [m/s^2]
  Eigen::Vector3d omega_I = Eigen::Vector3d::Zero();       ///< angular velocity of I, in I [rad/s]
  Eigen::Vector3d alpha_I = Eigen::Vector3d::Zero();  ///< angular acceleration in dv_dt_O, in I [rad/s^2]
};

/// Carries the motion from a state to the time of measurement, tau = stamp - t_O (docs/method.md, section 5).
struct RadarMotionModel {
  TimeOffsetModel kind = TimeOffsetModel::kImu;
  double max_time_offset = 0.25;                  ///< [s] beyond it, t_O changes nothing
  Eigen::Vector3d g_W = Eigen::Vector3d::Zero();  ///< gravity in W [m/s^2]
  /// Must outlive the model and keep the samples between the state and stamp -+ max_time_offset.
  const ImuBuffer* imu = nullptr;

  /// kImu, eq. 14-18: dR and dv integrate the IMU from the state to tau, forwards or backwards, at the biases
  /// of the state, with T = tau - state_time. Exact for any shift that the IMU covers.
  ///
  /// kConstantAcceleration, eq. 13, paper eq. (4)-(5): one acceleration stands for the whole shift; the state
  /// is at the stamp:
  ///   v_I = R_IW v_W + (omega - b_g) x l_I - t_O a_c,   a_c = a - b_a + R_IW g_W,
  /// with omega at the stamp, and for a the mean around it.
  /// `l_I` is the radar in I [m]; `mean` is the mean of the IMU at meanTime.
  /// If `mean` is null, kImu leaves the derivatives zero, and kConstantAcceleration takes the mean over
  /// kOffsetHalfWidth to either side.
  RadarMotion at(const StateView& x, Time state_time, Time stamp, double t_O, const Eigen::Vector3d& l_I,
                 const ImuMean* mean) const;
  /// Centre of the mean of the IMU for the derivative with respect to t_O: tau rounded to a millisecond, or
  /// the stamp. A smaller change of t_O needs no new mean.
  Time meanTime(Time stamp, double t_O) const;

 private:
  Time tau(Time stamp, double t_O) const;
  RadarMotion carriedByImu(const StateView& x, Time state_time, Time tau, const Eigen::Vector3d& l_I,
                           const ImuMean* mean) const;
  RadarMotion carriedByOneAcceleration(const StateView& x, Time stamp, double t_O, const Eigen::Vector3d& l_I,
                                       const ImuMean& mean) const;
};

}  // namespace rio_t
