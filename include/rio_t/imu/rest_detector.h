#pragma once

#include <Eigen/Geometry>

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
  /// [m/s] per axis, of the zero velocity at rest: a hand that holds still drifts by some cm/s. It also turns
  /// by some mrad/s, more than the gyro bias is known at the start. So rest on the way does not inform the
  /// bias.
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

/// Whether the IMU is at rest over the window that ends at `time`.
///
/// The IMU sees rest that a radar cannot see: a Doppler bin hides slow motion, and a moving object can fill
/// the view. The IMU alone cannot distinguish rest from uniform motion, hence the context.
bool isAtRest(const ImuBuffer& imu, Time time, const RestContext& context, const RestOptions& options);

/// Whether the IMU may be at rest on a platform that shakes, as one whose engine idles: its means over the
/// window are those of rest, within three sigmas of what the shaking leaves in them. How much it shakes does
/// not count. It takes a radar that sees no motion to call it rest.
bool mayRestShaking(const ImuBuffer& imu, Time time, const RestContext& context, const RestOptions& options);

}  // namespace rio_t
