#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rio_t/odometry/initializer.h"
#include "rio_t/odometry/navigation.h"
#include "rio_t/odometry/options.h"
#include "rio_t/odometry/scan_result.h"

namespace rio_t {

/// The whole pipeline: IMU and scans in, odometry and time offset out.
///
/// It has two halves that may run in two threads. `addImu` is the navigation half: it carries the newest
/// optimised state forward and never waits for the solver. `process` is the optimisation half. In one thread,
/// call `process` after each `addImu` and each `addScan`; then the same input gives the same output, bit for
/// bit. `addImu` and `addScan` may be called from different threads, `process` from one thread at a time.
class RadarInertialOdometry {
 public:
  explicit RadarInertialOdometry(const OdometryOptions& options);
  ~RadarInertialOdometry();
  RadarInertialOdometry(RadarInertialOdometry&&) noexcept;
  RadarInertialOdometry& operator=(RadarInertialOdometry&&) noexcept;

  /// Returns the samples that the estimator takes, and the state at this sample, carried from the newest
  /// optimised state, as a live user gets it. Drops samples that are out of order or not finite, and counts
  /// them in `faults()`. Counts gaps and saturated samples, too, and widens the uncertainty over them (see
  /// ImuInputCheck). If the IMU's clock jumps, everything starts again with an initialisation.
  Navigation::Checked addImu(const ImuMeasurement& imu);

  /// Queues a scan. It waits until the IMU covers its time of measurement. Throws std::invalid_argument for a
  /// radar that the options do not have.
  void addScan(RadarScan scan);

  /// Queues a pressure, if the options use the barometer. `faults()` counts "pressure_not_usable" (see
  /// faultOf), "pressure_out_of_order", "pressure_ahead_of_imu" and "pressure_without_node".
  void addPressure(const Pressure& pressure);

  /// Does the work that is due: initialisation, ego-velocity, window. Returns a result for each scan that it
  /// finished. It takes up to `max_scans` scans, the others wait for the next call; of those that wait, it
  /// drops the oldest beyond `max_queued_scans` (rejected as "queue_full").
  std::vector<ScanResult> process(std::size_t max_scans = std::numeric_limits<std::size_t>::max());

  /// Changes options while the estimator runs: in effect from the next `process` on. Any thread.
  void tune(const Tuning& tuning);

  /// At the end of the data: finishes the scans that still wait (rejected as "imu_not_covering" if the IMU
  /// never came) and empties the window. `left_window` of the last result has the poses from it.
  std::vector<ScanResult> finish();

  bool initialized() const;
  /// Whether the estimate can be trusted, as of the last `process`. Any thread. `faults()` counts each
  /// divergence as "diverged" and each re-initialisation as "reinitialized".
  Health health() const;
  /// The time and the prior of the first node; none before initialisation. Only in the thread of `process`.
  using Start = Initialization;
  std::optional<Start> start() const;
  /// Returns what the scans of a radar have shown so far. Call it from the thread that calls `process`.
  RadarKnowledge radarKnowledge(std::size_t radar = 0) const;
  /// Noise of the IMU, measured over the last second. Any thread.
  MeasuredImuNoise imuNoise() const;
  /// Root mean square of this noise since the first sample. Any thread.
  MeasuredImuNoise imuNoiseOfRun() const;
  /// Why there is no state yet, while not initialised. Any thread.
  StartWait waitingFor() const;
  /// Faults of the input so far, by name in snake case, e.g. "imu_out_of_order", "imu_not_finite", "imu_gap".
  std::map<std::string, std::uint64_t> faults() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace rio_t
