#pragma once

#include <optional>
#include <string>

#include "rio_t/imu/static_initializer.h"
#include "rio_t/odometry/motion_initializer.h"
#include "rio_t/odometry/options.h"

namespace rio_t {

/// Where a first state came from.
enum class InitializedFrom { kRest, kMotion };
std::string toString(InitializedFrom from);  ///< "rest" or "motion"

struct Initialization {
  Time time;
  NodePrior prior;        ///< on the state and on the calibration of `radar`
  std::size_t radar = 0;  ///< whose velocities it is from; the first, from rest
  InitializedFrom from = InitializedFrom::kRest;
  ModelErrorScale model_error_scale;  ///< of the velocities behind it
};

/// Finds the first state by `init_mode`: from rest if IMU and radar see some, else from motion. Not
/// thread-safe.
class Initializer {
 public:
  explicit Initializer(const OdometryOptions& options);

  /// Call it once per sample, in time order. `imu` ends with the sample `newest` and reaches imuHistory()
  /// back.
  std::optional<Initialization> add(const ImuMeasurement& newest, const ImuBuffer& imu);
  /// Velocity of a scan of a radar before there is a state.
  void addVelocity(std::size_t radar, Time stamp, const EgoVelocity& velocity) {
    motion_.at(radar).add(stamp, velocity);
  }

  /// Tells people what the start is waiting for.
  std::string waitingFor() const;
  double imuHistory() const { return motion_.front().imuHistory(); }  ///< [s]

 private:
  bool mayStartInMotion() const;
  /// Whether the radars show motion in that time, and none shows rest.
  bool isMoving(Time from, Time to) const;

  OdometryOptions options_;  // read-only after construction
  StaticInitializer rest_;
  std::vector<MotionInitializer> motion_;  ///< by radar
  std::optional<Time> first_, newest_;
  bool radar_contradicts_rest_ = false;
};

}  // namespace rio_t
