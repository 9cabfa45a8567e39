#pragma once

#include <atomic>
#include <chrono>
#include <cmath>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "rio_t/evaluation/trajectory.h"
#include "rio_t/odometry/body_odometry.h"
#include "rio_t/odometry/radar_inertial_odometry.h"
#include "rio_t/ros/cloud/stamping.h"
#include "rio_t/ros/live/bounded_trajectory.h"
#include "rio_t/ros/live/offset_observability.h"

namespace rio_t {

/// All that one run of the estimator remembers. A reset takes a new one, so nothing of the old can leak into
/// it.
///
/// Three threads meet here: the one of the IMU, the one of radar and triggers, and the one that optimises.
class LiveSession {
 public:
  using Clock = std::chrono::steady_clock;

  /// A scan that gets no stamp.
  struct GivenUp {
    std::size_t radar = 0;
    std::string reason;
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
  /// White noise of one gyro sample [rad/s], from its density and the rate seen so far. Any thread.
  double rateSigma() const { return gyro_density_ * std::sqrt(imu_rate_); }

  // Stamping; any thread, `record` is the time of receipt. They return the scans that get no stamp.
  std::vector<GivenUp> stampWithImu(Time stamp, Time record);
  /// Throws as ScanStamper, as the next does.
  std::vector<GivenUp> addTrigger(std::size_t radar, std::uint32_t seq, Time stamp, Time record);
  /// The stamp of `scan` is not read.
  std::vector<GivenUp> addScan(std::uint32_t seq, Time header_stamp, Time record, RadarScan scan);

  /// A result with what goes with it.
  struct Result {
    ScanResult result;
    bool offset_observable = false;
    /// The time of measurement, stamp - t_O, with the newest estimate of this radar's t_O. Before there is
    /// one, the stamp.
    Time measured_at;
    Extrinsics T_IR;       ///< of this radar, as they hold now; also where the window was not updated
    double latency = 0.0;  ///< [s] from when the scan got its stamp to now; 0 where that is not known
  };
  /// Optimisation thread. Uses at most one scan, so that a reset waits for one solution only. `more` tells
  /// whether there may be another.
  std::vector<Result> process(bool* more);

  /// Optimised poses so far, those that left the window, and the newest. Of more than `kMaxPoses`, one in so
  /// many is kept: `stride` says of how many.
  Trajectory trajectory(std::size_t* stride = nullptr) const;
  static constexpr std::size_t kMaxPoses = 36000;  ///< an hour at 10 Hz, 3 MB
  const RadarInertialOdometry& odometry() const { return odometry_; }
  /// As RadarInertialOdometry::start(), of the last call of process(). Any thread.
  std::optional<RadarInertialOdometry::Start> start() const;
  /// Takes effect before the next scan. Any thread.
  void tune(const Tuning& tuning) {
    gyro_density_ = tuning.imu_noise.gyro_density;
    odometry_.tune(tuning);
  }

  /// Place of this session's world in the odometry frame; none before it is known. Set once. Any thread.
  std::optional<WorldInOdom> world() const;
  void setWorld(const WorldInOdom& T_OW);

 private:
  /// A radar's way from messages to stamped scans.
  struct Stamper {
    ScanStamper stamper;
    std::map<std::string, std::uint64_t> given_up;  ///< what was reported so far
  };
  /// What the results of one radar leave behind.
  struct Radar {
    OffsetObservability observability;
    Extrinsics T_IR;
    std::optional<double> time_offset;  ///< [s] newest estimate
  };
  using ScanKey = std::pair<std::size_t, std::int64_t>;  // radar, stamp [ns]

  std::vector<GivenUp> takeStamped();  // call with stamper_mutex_ held

  std::atomic<double> gyro_density_;
  RadarInertialOdometry odometry_;
  std::atomic<std::size_t> waiting_imu_{0};  // samples since the optimisation thread last took them

  std::atomic<double> imu_rate_{1.0};  // [Hz]
  std::optional<Time> first_imu_;      // IMU thread only, as the next
  std::uint64_t imu_count_ = 0;

  std::mutex stamper_mutex_;
  std::vector<Stamper> stampers_;  // by radar; guarded by stamper_mutex_

  std::map<ScanKey, Clock::time_point> arrivals_;  // guarded by stamper_mutex_

  std::vector<Radar> radars_;  // optimisation thread only

  mutable std::mutex start_mutex_;
  std::optional<RadarInertialOdometry::Start> start_;  // guarded by start_mutex_, as the next
  std::optional<WorldInOdom> world_;

  mutable std::mutex trajectory_mutex_;
  BoundedTrajectory left_window_{kMaxPoses};  // guarded by trajectory_mutex_, as the next
  std::optional<StampedPose> newest_;
};

}  // namespace rio_t
