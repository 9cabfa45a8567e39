#include "rio_t/factors/offset_derivative.h"

#include <Eigen/Geometry>

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

}  // namespace rio_t
