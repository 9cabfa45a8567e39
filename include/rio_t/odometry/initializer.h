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
  NodePrior prior;
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
  /// Velocity of a scan before there is a state.
  void addVelocity(Time stamp, const EgoVelocity& velocity) { motion_.add(stamp, velocity); }

  /// Tells people what the start is waiting for.
  std::string waitingFor() const;
  double imuHistory() const { return motion_.imuHistory(); }  ///< [s]

 private:
  bool mayStartInMotion() const;

  OdometryOptions options_;  // read-only after construction
  StaticInitializer rest_;
  MotionInitializer motion_;
  std::optional<Time> first_, newest_;
  bool radar_contradicts_rest_ = false;
};

}  // namespace rio_t
