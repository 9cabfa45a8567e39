#include "rio_t/imu/rest_detector.h"

#include <cmath>
#include <optional>

namespace rio_t {

namespace {

/// Deviations of the IMU from what rest would read.
struct Deviation {
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();           ///< mean [rad/s]
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();          ///< mean [m/s^2]
  Eigen::Vector3d gyro_variance = Eigen::Vector3d::Zero();  ///< about the mean
  Eigen::Vector3d accel_variance = Eigen::Vector3d::Zero();
  double count = 0.0;
};

/// Over the window that ends at `time`; none if the estimate moves, or too little was measured.
std::optional<Deviation> deviationFromRest(const ImuBuffer& imu, Time time, const RestContext& context,
                                           const RestOptions& options) {
  if (!options.enabled || context.v_W.norm() > options.max_speed || !imu.covers(time - options.window)) {
    return std::nullopt;
  }
  bool is_measured = true;
  Deviation d;
  Eigen::Vector3d gyro_square = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_square = Eigen::Vector3d::Zero();
  // Deviations from what rest would read: small numbers, so that their squares do not cancel.
  const Eigen::Vector3d accel_at_rest = context.b_a - context.q_WI.conjugate() * context.g_W;
  imu.forEachSample(time - options.window, time, [&](const ImuMeasurement& sample) {
    const Eigen::Vector3d rate = sample.angular_velocity - context.b_g;
    const Eigen::Vector3d acceleration = sample.acceleration - accel_at_rest;
    d.gyro += rate;
    d.accel += acceleration;
    gyro_square += rate.cwiseAbs2();
    accel_square += acceleration.cwiseAbs2();
    d.count += 1.0;
    is_measured &= !sample.is_bridge;
  });
  if (!is_measured || d.count < 10.0) return std::nullopt;  // too few for a standard deviation
  d.gyro /= d.count;
  d.accel /= d.count;
  d.gyro_variance = gyro_square / d.count - d.gyro.cwiseAbs2();
  d.accel_variance = accel_square / d.count - d.accel.cwiseAbs2();
  return d;
}

}  // namespace

std::optional<Rest> findRest(const ImuBuffer& imu, Time time, const RestContext& context,
                             const RestOptions& options) {
  const std::optional<Deviation> d = deviationFromRest(imu, time, context, options);
  if (!d) return std::nullopt;
  Rest rest;
  rest.shakes = d->gyro_variance.maxCoeff() >= options.max_gyro_std * options.max_gyro_std ||
                d->accel_variance.maxCoeff() >= options.max_accel_std * options.max_accel_std;
  // Three sigmas of a mean over independent samples. A vibration of one frequency averages out faster.
  const auto left = [&](const Eigen::Vector3d& variance) {
    return rest.shakes ? 3.0 * std::sqrt(variance.sum() / d->count) : 0.0;
  };
  if (d->gyro.norm() >= options.max_rate + left(d->gyro_variance) ||
      d->accel.norm() >= options.max_accel_error + left(d->accel_variance))
    return std::nullopt;
  rest.velocity_sigma = std::hypot(options.velocity_sigma, d->accel.norm() * options.window);
  return rest;
}

}  // namespace rio_t
