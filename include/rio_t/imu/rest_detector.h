#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "rio_t/imu/buffer.h"

namespace rio_t {

struct RestOptions {
  bool enabled = true;
  double window = 0.5;           ///< [s] for which the platform must have been still
  double max_gyro_std = 0.01;    ///< [rad/s] per axis over the window
  double max_accel_std = 0.1;    ///< [m/s^2] per axis over the window
  double max_rate = 3.0e-3;      ///< [rad/s] mean gyro without bias
  double max_accel_error = 0.1;  ///< [m/s^2] mean accelerometer without bias and gravity
  double max_speed = 0.1;        ///< [m/s] estimated; above it, stillness is a smooth ride
  /// [m/s] of the zero velocity, per axis. At about this speed a platform may creep unseen by radar and IMU.
  double velocity_sigma = 0.01;
};

/// The estimated state, which distinguishes rest from a smooth ride.
struct RestContext {
  Eigen::Quaterniond q_WI = Eigen::Quaterniond::Identity();
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero();  ///< [m/s]
  Eigen::Vector3d b_g = Eigen::Vector3d::Zero();  ///< [rad/s]
  Eigen::Vector3d b_a = Eigen::Vector3d::Zero();  ///< [m/s^2]
  Eigen::Vector3d g_W = Eigen::Vector3d::Zero();  ///< [m/s^2]
};

/// Rest over a window, as the IMU shows it.
struct Rest {
  /// The IMU vibrates, as with an engine that idles. Then it is a rest only if a radar sees no motion.
  bool shakes = false;
  /// [m/s] of the zero velocity, per axis. It includes the unexplained mean acceleration over the window: the
  /// platform may just have set off.
  double velocity_sigma = 0.0;
};

/// Rest over the window that ends at `time`, if the IMU shows no motion. If it shakes, its means over the
/// window must be those of rest, within three sigmas of what the shaking leaves in them.
///
/// The IMU sees rest that a radar cannot see: a Doppler bin hides slow motion, and a moving object can fill
/// the view. The IMU alone cannot distinguish rest from uniform motion, hence the context. A hand that holds
/// still turns by some mrad/s, which is more than the sigma of the gyro bias after the start. So rest during
/// a run gives no measurement of the bias.
std::optional<Rest> findRest(const ImuBuffer& imu, Time time, const RestContext& context,
                             const RestOptions& options);

}  // namespace rio_t
