#pragma once

#include <deque>
#include <optional>

#include "rio_t/imu/error_step.h"
#include "rio_t/imu/measurement.h"
#include "rio_t/imu/noise.h"
#include "rio_t/odometry/navigation_state.h"

namespace rio_t {

/// Carries the newest optimised state forward with the IMU: the paper's navigation thread. Not thread-safe.
class ImuPropagator {
 public:
  /// `g_W`: gravity in W [m/s^2].
  ImuPropagator(const ImuNoise& noise, const Eigen::Vector3d& g_W) : noise_(noise), g_W_(g_W) {}

  /// Samples must be in time order.
  void add(const ImuMeasurement& imu);

  /// Starts again from a new optimised state, usually some 100 ms before the newest sample, and integrates
  /// all samples since then. Ignores a state that is older than the oldest sample it has kept: it keeps 30 s
  /// at most, and fewer after dropBefore().
  /// `at_rest`: the platform stood still then, and `state` has no velocity. While the IMU vibrates, velocity
  /// and position stay where they are until the IMU shows more than its noise.
  void anchor(const NavigationState& state, bool at_rest = false);
  /// Forgets the samples that only anchors before `time` need.
  void dropBefore(Time time);
  /// Sets the noise of the IMU for the samples to come.
  void setNoise(const ImuNoise& noise) { noise_ = noise; }
  /// At the newest sample; none before the first anchor. Its covariance may be kCovarianceStep older.
  std::optional<NavigationState> state() const;

 private:
  void propagate(const ImuMeasurement& from, const ImuMeasurement& to);

  ImuNoise noise_;
  Eigen::Vector3d g_W_;  // read-only after construction
  std::deque<ImuMeasurement> history_;
  std::optional<NavigationState> state_;
  SampleSum samples_;                    ///< since the time of the covariance
  std::optional<NavigationState> rest_;  ///< the anchor, if the platform was at rest there
};

}  // namespace rio_t
