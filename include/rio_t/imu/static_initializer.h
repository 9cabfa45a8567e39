#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "rio_t/imu/measurement.h"

namespace rio_t {

/// Why the estimate has not started.
enum class StartObstacle {
  kTooFewData,     ///< nothing speaks against a start so far
  kMotion,         ///< the platform does not rest
  kWrongGravity,   ///< the mean accelerometer does not read gravity
  kContradiction,  ///< radar and IMU contradict each other
};

/// An initialiser returns this while it has not started the estimate.
struct StartWait {
  StartObstacle obstacle = StartObstacle::kTooFewData;
  std::string text;  ///< what the initialiser waits for, for people
};

struct StaticInitializerOptions {
  double duration = 3.0;           ///< [s] of rest that is averaged
  double max_gyro_std = 0.05;      ///< [rad/s] per axis over the duration: above, the platform moves
  double max_accel_std = 0.5;      ///< [m/s^2] likewise
  double max_gyro_mean = 0.1;      ///< [rad/s] a larger mean is a rotation, not a bias
  double max_gravity_error = 0.5;  ///< [m/s^2] | |mean accelerometer| - gravity |
};

/// State found at rest (docs/method.md, section 3).
struct StaticInitialization {
  Time time;                                                 ///< of the last sample used
  Eigen::Quaterniond q_WI = Eigen::Quaterniond::Identity();  ///< levelled, yaw zero
  Eigen::Vector3d b_g = Eigen::Vector3d::Zero();             ///< mean gyro [rad/s]
  Eigen::Vector3d f_I = Eigen::Vector3d::Zero();             ///< mean specific force [m/s^2]
  /// The vertical part of the bias [m/s^2]: f_I without gravity. The horizontal part cannot be distinguished
  /// from a tilt.
  Eigen::Vector3d b_a = Eigen::Vector3d::Zero();
  double duration = 0.0;  ///< [s]
};

/// Waits for `duration` seconds of rest. If the platform sets off earlier, it uses the rest before, if that
/// lasted a second: a smooth start must not count as rest. Works with any mounting (gravity on any axis).
class StaticInitializer {
 public:
  StaticInitializer(const StaticInitializerOptions& options, double gravity);
  /// Feeds one sample; the result once enough rest has been seen. Samples must be in time order.
  std::optional<StaticInitialization> add(const ImuMeasurement& imu);
  const StartWait& waitingFor() const { return waiting_for_; }
  /// Whether the platform moved for a while.
  bool hasSeenMotion() const { return has_seen_motion_; }

 private:
  /// Whether the platform sets off: the newest mean acceleration differs from the mean before by more than
  /// noise and a fifth of max_accel_std.
  bool endsNow();

  StaticInitializerOptions options_;  // read-only after construction
  double gravity_;                    // read-only after construction
  std::vector<ImuMeasurement> samples_;
  StartWait waiting_for_{StartObstacle::kTooFewData, "the first IMU sample"};
  bool has_seen_motion_ = false;
  Time checked_at_;
};

/// Shortest rotation that turns the measured specific force at rest, in I, onto the upward axis of W; yaw
/// zero in the sense that no rotation about the vertical is added. Works for every `f_I`, also straight down.
Eigen::Quaterniond levelingRotation(const Eigen::Vector3d& f_I);

}  // namespace rio_t
