#pragma once

#include <atomic>
#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "rio_t/evaluation/trajectory.h"
#include "rio_t/odometry/radar_inertial_odometry.h"
#include "rio_t/ros/cloud/stamping.h"
#include "rio_t/ros/live/bounded_trajectory.h"
#include "rio_t/ros/live/offset_observability.h"
#include "rio_t/ros/live/scan_queue.h"

namespace rio_t {

/// All that one run of the estimator remembers. A reset takes a new one, so nothing of the old can leak into
/// it.
///
/// Three threads meet here: the one of the IMU, the one of radar and triggers, and the one that optimises.
class LiveSession {
 public:
  using Clock = std::chrono::steady_clock;

  /// What stamping did besides giving stamps.
  struct Stamped {
    struct GivenUp {
      std::size_t radar = 0;
      std::string reason;
    };
    std::size_t queued = 0;            ///< scans handed to the optimisation thread
    std::vector<std::size_t> dropped;  ///< radars of the scans that had to go because the queue was full
    std::vector<GivenUp> given_up;     ///< one for each scan that gets no stamp
  };

  /// `options` is config.odometry with the extrinsics that hold. Radars are counted as in configsOfRadars.
  LiveSession(const Config& config, const OdometryOptions& options);

  /// IMU thread. Empty before the first optimised state.
  std::optional<NavigationState> addImu(const ImuMeasurement& imu);
  /// Any thread.
  void addPressure(const Pressure& pressure) { odometry_.addPressure(pressure); }
  /// The optimisation thread has taken none of the last `kMaxWaitingImu` samples: it must be stuck, and what
  /// waits for it would grow without end. Any thread.
  bool imuPilesUp() const { return waiting_imu_ >= kMaxWaitingImu; }
  static constexpr std::size_t kMaxWaitingImu = 20000;  ///< 49 s at 409 Hz
  /// White noise of one gyro sample [rad/s], from its density and the rate seen so far. IMU thread.
  double rateSigma(Time sample);

  // Stamping; any thread, `record` is the time of receipt.
  Stamped stampWithImu(Time stamp, Time record);
  Stamped addTrigger(std::size_t radar, std::uint32_t seq, Time stamp, Time record);
  /// Throws as ScanStamper. The stamp of `scan` is not read.
  Stamped addScan(std::uint32_t seq, Time header_stamp, Time record, RadarScan scan);

  /// A result with what goes with it.
  struct Result {
    ScanResult result;
    bool offset_observable = false;
    Extrinsics T_IR;       ///< of this radar, as they hold now; also where the window was not updated
    double latency = 0.0;  ///< [s] from the arrival of the scan to now; 0 where that is not known
  };
  /// Optimisation thread: takes one scan from the queue, if there is one, and works off what can be. `more`
  /// tells whether there was one.
  std::vector<Result> process(bool* more);

  /// Optimised poses so far, those that left the window, and the newest. Of more than `kMaxPoses`, one in so
  /// many is kept: `stride` says of how many.
  Trajectory trajectory(std::size_t* stride = nullptr) const;
  static constexpr std::size_t kMaxPoses = 36000;  ///< an hour at 10 Hz, 3 MB
  const RadarInertialOdometry& odometry() const { return odometry_; }
  std::size_t queuedScans() const { return queue_.size(); }

 private:
  /// A radar's way from messages to stamped scans.
  struct Stamper {
    ScanStamper stamper;
    std::map<std::string, std::uint64_t> given_up;  ///< what was told so far
  };
  /// What the results of one radar leave behind.
  struct Radar {
    OffsetObservability observability;
    Extrinsics T_IR;
  };
  using ScanKey = std::pair<std::size_t, std::int64_t>;  // radar, stamp [ns]

  Stamped takeStamped();  // call with stamper_mutex_ held
  void takeStamped(std::size_t radar, Stamped* stamped);

  const double gyro_density_;
  RadarInertialOdometry odometry_;
  std::atomic<std::size_t> waiting_imu_{0};  // samples since the optimisation thread last took them

  std::optional<Time> first_imu_;  // IMU thread only, as the next
  std::uint64_t imu_count_ = 0;

  std::mutex stamper_mutex_;
  std::vector<Stamper> stampers_;  // by radar; guarded by stamper_mutex_

  ScanQueue queue_;  // thread-safe

  std::map<ScanKey, Clock::time_point> arrivals_;  // optimisation thread only, as the next
  std::vector<Radar> radars_;

  mutable std::mutex trajectory_mutex_;
  BoundedTrajectory left_window_{kMaxPoses};  // guarded by trajectory_mutex_, as the next
  std::optional<StampedPose> newest_;
};

}  // namespace rio_t
