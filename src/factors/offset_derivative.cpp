#include "rio_t/factors/offset_derivative.h"

#include <algorithm>

namespace rio_t {

double offsetHalfWidth(const ImuBuffer& imu, Time time) {
  // Weights that fall linearly over w to either side average like an even mean over 4/3 w.
  const double needed = 0.75 * imu.at(time).accel_noise / (kMaxRateNoise * kMaxRateNoise);
  return std::clamp(needed, kOffsetHalfWidth, kMaxOffsetHalfWidth);
}

VelocityRate velocityRate(const ImuMean& imu, const Eigen::Vector3d& b_g, const Eigen::Vector3d& b_a,
                          const Eigen::Vector3d& v_I, const Eigen::Vector3d& g_I,
                          const Eigen::Vector3d& l_I) {
  const Eigen::Vector3d omega = imu.angular_velocity - b_g;
  VelocityRate rate;
  rate.a_I = imu.acceleration - b_a + g_I - omega.cross(v_I) + imu.angular_acceleration.cross(l_I);
  if (imu.duration == 0.0) return rate;
  // A mean over w has the variance density^2 / w; the difference of two such means, over w, 2 density^2 /
  // w^3.
  rate.variance = (imu.accel_variance + imu.gyro_variance * v_I.squaredNorm()) / imu.duration;
  const double w = imu.half_duration;
  if (w > 0.0) rate.variance += 2.0 * imu.gyro_variance * l_I.squaredNorm() / (w * w * w);
  return rate;
}

VelocityRate velocityRate(const ImuBuffer& imu, Time tau, const StateBlock& x, const Eigen::Vector3d& g_W,
                          const Eigen::Vector3d& l_I) {
  const Eigen::Quaterniond q_IW = x.q_WI().conjugate();
  return velocityRate(imu.mean(tau, offsetHalfWidth(imu, tau)), x.b_g(), x.b_a(), q_IW * x.v_W(), q_IW * g_W,
                      l_I);
}

}  // namespace rio_t
