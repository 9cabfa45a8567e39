#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <vector>

#include "rio_t/imu/input_check.h"
#include "rio_t/odometry/imu_propagator.h"
#include "rio_t/odometry/options.h"

namespace rio_t {

/// The paper's navigation thread: checks each IMU sample and carries the newest optimised state to it. Never
/// waits for the solver. Thread-safe; a call takes microseconds.
class Navigation {
 public:
  Navigation(const OdometryOptions& options, const Eigen::Vector3d& g_W);

  /// The result of one sample.
  struct Checked {
    ImuSampleCheck::Verdict sample;
    std::vector<ImuMeasurement> taken;  ///< the bridge over a gap before the sample, then the sample; or none
    std::vector<const char*> faults;    ///< names for FaultCounters
    std::uint64_t clock_restarts = 0;   ///< how often the clock of the IMU has jumped so far
    /// As published, at the sample; none before the first anchor.
    std::optional<NavigationState> state;
  };
  Checked add(const ImuMeasurement& imu);

  /// Takes the newest optimised state, and the noise of the IMU for the samples to come. No later anchor is
  /// older than `oldest`. Ignores all if the clock restarted since `clock_restarts`.
  void anchor(const NavigationState& state, bool at_rest, const ImuNoise& noise, Time oldest,
              std::uint64_t clock_restarts);

  /// At the newest sample. Its covariance is linear in the heading (without docs/method.md, eq. 34a).
  std::optional<NavigationState> state() const;
  MeasuredImuNoise imuNoise() const;       ///< over the last second
  MeasuredImuNoise imuNoiseOfRun() const;  ///< root mean square since the first sample

 private:
  const ImuNoise imu_noise_;
  const Eigen::Vector3d g_W_;
  mutable std::mutex mutex_;  // guards what follows
  ImuInputCheck input_check_;
  ImuPropagator propagator_;
  std::uint64_t clock_restarts_ = 0;
  double accel_noises_ = 0.0;  ///< sum of ImuMeasurement::accel_noise
  double gyro_noises_ = 0.0;   ///< likewise
  double samples_ = 0.0;       ///< in both sums
};

}  // namespace rio_t
