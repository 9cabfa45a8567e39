#include "rio_t/factors/radar_motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>

#include "rio_t/core/so3.h"
#include "rio_t/imu/preintegration.h"

namespace rio_t {

VelocityRate velocityRate(const ImuMean& imu, const Eigen::Vector3d& b_g, const Eigen::Vector3d& b_a,
                          const Eigen::Vector3d& v_I, const Eigen::Vector3d& g_I,
                          const Eigen::Vector3d& l_I) {
  const Eigen::Vector3d omega = imu.angular_velocity - b_g;
  VelocityRate rate;
  rate.a_I = imu.acceleration - b_a + g_I - omega.cross(v_I) + imu.angular_acceleration.cross(l_I);
  if (imu.duration == 0.0) return rate;
  // A mean over w has the variance density^2 / w. The difference of two, over w, has 2 density^2 / w^3.
  rate.variance = (imu.accel_variance + imu.gyro_variance * v_I.squaredNorm()) / imu.duration;
  const double w = imu.half_duration;
  if (w > 0.0) rate.variance += 2.0 * imu.gyro_variance * l_I.squaredNorm() / (w * w * w);
  return rate;
}

RadarMotion RadarMotionModel::at(const StateView& x, Time state_time, Time stamp, double t_O,
                                 const Eigen::Vector3d& l_I, const ImuMean* mean) const {
  if (kind == TimeOffsetModel::kConstantAcceleration)
    return carriedByOneAcceleration(x, stamp, t_O, l_I,
                                    mean != nullptr ? *mean : imu->mean(stamp, kOffsetHalfWidth));
  return carriedByImu(x, state_time, tau(stamp, t_O), l_I, mean);
}

Time RadarMotionModel::tau(Time stamp, double t_O) const {
  return stamp - std::clamp(t_O, -max_time_offset, max_time_offset);
}

Time RadarMotionModel::meanTime(Time stamp, double t_O) const {
  if (kind == TimeOffsetModel::kConstantAcceleration) return stamp;
  constexpr std::int64_t kMillisecond = 1'000'000;  // [ns]
  return Time::fromNanoseconds((tau(stamp, t_O).nanoseconds() + kMillisecond / 2) / kMillisecond *
                               kMillisecond);
}

RadarMotion RadarMotionModel::carriedByImu(const StateView& x, Time state_time, Time tau,
                                           const Eigen::Vector3d& l_I, const ImuMean* mean) const {
  const ImuDelta delta = integrate(*imu, state_time, tau, x.b_g, x.b_a);
  const Eigen::Matrix3d R_IW = x.q_WI.toRotationMatrix().transpose();  // at the state
  const Eigen::Matrix3d dR_T = delta.dR.toRotationMatrix().transpose();
  const Eigen::Vector3d carried = R_IW * (x.v_W + delta.dt * g_W);
  const Eigen::Vector3d v_tau = dR_T * (carried + delta.dv);  // of I, in I at tau

  RadarMotion motion;
  motion.omega_I = imu->at(tau).angular_velocity - x.b_g;
  motion.v_I = v_tau + motion.omega_I.cross(l_I);
  if (mean == nullptr) return motion;
  motion.J_motion.middleCols<3>(StateBlock::kQStored) = dR_T * so3::hat(carried);
  motion.J_motion.middleCols<3>(StateBlock::kVStored) = dR_T * R_IW;
  motion.J_biases.leftCols<3>() = dR_T * delta.dv_dbg + so3::hat(v_tau) * delta.dR_dbg + so3::hat(l_I);
  motion.J_biases.rightCols<3>() = dR_T * delta.dv_dba;
  motion.dv_dt_O = -velocityRate(*mean, x.b_g, x.b_a, v_tau, dR_T * R_IW * g_W, l_I).a_I;
  motion.alpha_I = mean->angular_acceleration;
  return motion;
}

RadarMotion RadarMotionModel::carriedByOneAcceleration(const StateView& x, Time stamp, double t_O,
                                                       const Eigen::Vector3d& l_I,
                                                       const ImuMean& mean) const {
  const Eigen::Matrix3d R_IW = x.q_WI.toRotationMatrix().transpose();
  const Eigen::Vector3d v_I = R_IW * x.v_W;
  const Eigen::Vector3d g_I = R_IW * g_W;
  const Eigen::Vector3d a_c = mean.acceleration - x.b_a + g_I;

  RadarMotion motion;
  motion.omega_I = imu->at(stamp).angular_velocity - x.b_g;
  motion.v_I = v_I + motion.omega_I.cross(l_I) - t_O * a_c;
  motion.J_motion.middleCols<3>(StateBlock::kQStored) = so3::hat(v_I - t_O * g_I);
  motion.J_motion.middleCols<3>(StateBlock::kVStored) = R_IW;
  motion.J_biases.leftCols<3>() = so3::hat(l_I);
  motion.J_biases.rightCols<3>().diagonal().setConstant(t_O);
  motion.dv_dt_O = -a_c;
  return motion;
}

}  // namespace rio_t
