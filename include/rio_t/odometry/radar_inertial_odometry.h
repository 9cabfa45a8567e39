#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rio_t/odometry/initializer.h"
#include "rio_t/odometry/navigation_state.h"
#include "rio_t/odometry/options.h"
#include "rio_t/odometry/scan_result.h"

namespace rio_t {

/// The whole pipeline: IMU and scans in, odometry and time offset out.
///
/// Two halves that may run in two threads. `addImu` is the navigation half: it carries the newest optimised
/// state forward and never waits for the solver. `process` is the optimisation half. In one thread, call
/// `process` after each `addImu` and each `addScan`; then the same input gives the same output, bit for bit.
/// `addImu` and `addScan` may be called from different threads, `process` from one thread at a time.
class RadarInertialOdometry {
 public:
  explicit RadarInertialOdometry(const OdometryOptions& options);
  ~RadarInertialOdometry();
  RadarInertialOdometry(RadarInertialOdometry&&) noexcept;
  RadarInertialOdometry& operator=(RadarInertialOdometry&&) noexcept;

  /// State at this sample, from the newest optimised state: what a live user gets. None before
  /// initialisation. Samples that are out of place in time, or not finite, are dropped and counted in
  /// `faults()`, as are gaps and saturated samples, over which the uncertainty grows (see ImuInputCheck). Where the
  /// IMU's clock jumps, all starts again with an initialisation.
  std::optional<NavigationState> addImu(const ImuMeasurement& imu);

  /// Queues a scan. It waits until the IMU covers its time of measurement.
  void addScan(RadarScan scan);

  /// Works off what can be worked off: initialisation, ego-velocity, window. What became of each scan finished.
  std::vector<ScanResult> process();

  /// At the end of the data: finishes what still waits (rejected as "imu_not_covering" where the IMU never
  /// came), and empties the window; the poses still in it are in `left_window` of the last result.
  std::vector<ScanResult> finish();

  bool initialized() const;
  /// Whether the estimate can be trusted, as of the last `process`. Any thread. Each time that it diverges or
  /// is found anew is counted in `faults()`, as "diverged" and "reinitialized".
  Health health() const;
  /// Where the graph begins and what was known there; none before initialisation. Call it from the thread
  /// that calls `process`.
  using Start = Initialization;
  std::optional<Start> start() const;
  /// Noise of the radar's points, as learned so far. Likewise from that thread.
  PointVariances radarNoise() const;
  /// Noise that the IMU shows by itself, over the last second. Any thread.
  MeasuredImuNoise imuNoise() const;
  /// While not initialised: what is being waited for, for people.
  std::string waitingFor() const;
  /// Faults of the input so far, by name in snake case, e.g. "imu_out_of_order", "imu_not_finite", "imu_gap".
  std::map<std::string, std::uint64_t> faults() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace rio_t
