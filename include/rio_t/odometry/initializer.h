#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "rio_t/imu/static_initializer.h"
#include "rio_t/odometry/motion_initializer.h"
#include "rio_t/odometry/options.h"

namespace rio_t {

/// Finds the first state by `init_mode`: from rest if IMU and radar see rest, else from motion. After a
/// divergence it finds a new state in motion. Not thread-safe.
class Initializer {
 public:
  explicit Initializer(const OdometryOptions& options);

  /// Call it once per sample, in time order. `imu` ends with the sample `newest` and reaches imuHistory()
  /// back.
  std::optional<Initialization> add(const ImuMeasurement& newest, const ImuBuffer& imu);
  /// The state of a platform that moves, at a pose that is known; see MotionInitializer.
  std::optional<Initialization> findInMotion(const ImuBuffer& imu,
                                             const std::function<PoseAnchor(Time)>& anchorAt);
  /// Forgets the velocities, so that no scan counts twice.
  void forgetVelocities();
  void setImuNoise(const ImuNoise& noise);
  /// Velocity of a scan of a radar, measured without a prediction.
  void addVelocity(std::size_t radar, Time stamp, const EgoVelocity& velocity) {
    motion_.at(radar).add(stamp, velocity);
  }

  StartWait waitingFor() const;
  double imuHistory() const { return motion_.front().imuHistory(); }  ///< [s]

 private:
  bool mayStartInMotion() const;
  /// Whether the radars show motion in that time, and none shows rest.
  bool isMoving(Time from, Time to) const;

  OdometryOptions options_;  // only setImuNoise() changes them
  StaticInitializer rest_;
  std::vector<MotionInitializer> motion_;  ///< by radar
  std::optional<Time> first_, newest_;
  bool radar_contradicts_rest_ = false;
};

}  // namespace rio_t
