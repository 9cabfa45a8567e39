#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rio_t/core/pose.h"
#include "rio_t/factors/prior_factor.h"
#include "rio_t/odometry/initializer.h"
#include "rio_t/odometry/navigation_state.h"
#include "rio_t/odometry/options.h"
#include "rio_t/smoother/solver_termination.h"

namespace rio_t {

/// What became of one scan.
struct ScanResult {
  RadarScan scan;  ///< as fed
  EgoVelocity ego_velocity;
  bool used = false;               ///< its velocity went into the window
  double model_error_scale = 1.0;  ///< see ModelErrorScale; in the covariance of ego_velocity
  std::string rejected_because;    ///< snake case, empty where used; keys of `scans_rejected`

  /// The window was solved again: the scan was used, or the platform is at rest. What follows is set only
  /// then.
  bool updated = false;
  // The newest state of the window.
  NavigationState state;
  double time_offset = 0.0;        ///< t_O [s]
  double time_offset_sigma = 0.0;  ///< [s]
  int solver_iterations = 0;
  SolverTermination solver_termination = SolverTermination::kIterationLimit;
  Health health = Health::kOk;           ///< after this scan; set always
  bool reinitialized = false;            ///< the state was found anew before this scan
  std::vector<StampedPose> left_window;  ///< optimised poses that this scan pushed out, oldest first
};

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

  /// Takes what became of a scan. The result is used again for the next one; to keep it, move it away.
  using ResultHandler = std::function<void(ScanResult&)>;
  /// Works off what can be worked off: initialisation, ego-velocity, window. Calls `handle` for each scan
  /// finished. Allocates nothing once its buffers have grown to what the data need.
  void process(const ResultHandler& handle);
  /// The same, with the results in a list.
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
