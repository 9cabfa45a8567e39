#include "rio_t/imu/rest_detector.h"

namespace rio_t {

bool isAtRest(const ImuBuffer& imu, Time time, const RestContext& context, const RestOptions& options) {
  if (!options.enabled || context.v_W.norm() > options.max_speed || !imu.covers(time - options.window)) {
    return false;
  }
  double count = 0.0;
  bool is_measured = true;
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_square = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_square = Eigen::Vector3d::Zero();
  // Deviations from what rest would read: small numbers, so that their squares do not cancel.
  const Eigen::Vector3d accel_at_rest = context.b_a - context.q_WI.conjugate() * context.g_W;
  imu.forEachSample(time - options.window, time, [&](const ImuMeasurement& sample) {
    const Eigen::Vector3d rate = sample.angular_velocity - context.b_g;
    const Eigen::Vector3d acceleration = sample.acceleration - accel_at_rest;
    gyro += rate;
    accel += acceleration;
    gyro_square += rate.cwiseAbs2();
    accel_square += acceleration.cwiseAbs2();
    count += 1.0;
    is_measured &= !sample.is_bridge;
  });
  if (!is_measured || count < 10.0) return false;  // too few to speak of a spread
  gyro /= count;
  accel /= count;
  const Eigen::Vector3d gyro_variance = gyro_square / count - gyro.cwiseAbs2();
  const Eigen::Vector3d accel_variance = accel_square / count - accel.cwiseAbs2();
  return gyro_variance.maxCoeff() < options.max_gyro_std * options.max_gyro_std &&
         accel_variance.maxCoeff() < options.max_accel_std * options.max_accel_std &&
         gyro.norm() < options.max_rate && accel.norm() < options.max_accel_error;
}

}  // namespace rio_t
