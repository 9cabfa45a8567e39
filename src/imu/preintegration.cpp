#include "rio_t/imu/preintegration.h"

#include "rio_t/core/so3.h"
#include "rio_t/imu/error_step.h"

namespace rio_t {

void ImuDelta::step(double step_dt, const Eigen::Vector3d& omega, const Eigen::Vector3d& a) {
  const Eigen::Vector3d half_angle = 0.5 * step_dt * omega;
  const Eigen::Quaterniond half = so3::exp(half_angle);
  const Eigen::Matrix3d half_T = half.toRotationMatrix().transpose();
  const Eigen::Matrix3d R_mid = (dR * half).toRotationMatrix();
  const Eigen::Vector3d a_i = R_mid * a;

  // How the midpoint rotation moves with the gyro bias; the second half of the step does the same again.
  const Eigen::Matrix3d half_dbg = 0.5 * step_dt * so3::rightJacobian(half_angle);
  const Eigen::Matrix3d mid_dbg = half_T * dR_dbg - half_dbg;
  const Eigen::Matrix3d a_dbg = -R_mid * so3::hat(a) * mid_dbg;

  dp += dv * step_dt + 0.5 * step_dt * step_dt * a_i;
  dp_dbg += dv_dbg * step_dt + 0.5 * step_dt * step_dt * a_dbg;
  dp_dba += dv_dba * step_dt - 0.5 * step_dt * step_dt * R_mid;
  dv += step_dt * a_i;
  dv_dbg += step_dt * a_dbg;
  dv_dba -= step_dt * R_mid;
  dR_dbg = half_T * mid_dbg - half_dbg;
  dR = (dR * half * half).normalized();
  dt += step_dt;
}

ImuDelta integrate(const ImuBuffer& imu, Time from, Time to, const Eigen::Vector3d& b_g,
                   const Eigen::Vector3d& b_a) {
  ImuDelta delta;
  imu.forEachInterval(from, to, [&](double dt, const auto& gyro, const auto& accel, const auto&) {
    delta.step(dt, gyro - b_g, accel - b_a);
  });
  return delta;
}

Preintegration preintegrate(const ImuBuffer& buffer, Time from, Time to, const Eigen::Vector3d& b_g,
                            const Eigen::Vector3d& b_a, const ImuNoise& noise) {
  Preintegration result;
  result.b_g = b_g;
  result.b_a = b_a;
  SampleSum samples;
  buffer.forEachInterval(from, to, [&](double dt, const auto& gyro, const auto& accel, const auto& later) {
    const Eigen::Vector3d omega = gyro - b_g;
    const Eigen::Vector3d a = accel - b_a;
    samples.add(result.delta.dR, dt, omega, a, noise.gyroVariance(later), noise.accelVariance(later),
                later.unseen_velocity_variance);
    result.delta.step(dt, omega, a);
    if (samples.isWhole()) propagateCovariance(samples, result.covariance);
  });
  propagateCovariance(samples, result.covariance);
  return result;
}

}  // namespace rio_t
