#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "rio_t/evaluation/trajectory.h"
#include "rio_t/odometry/body_odometry.h"
#include "rio_t/odometry/radar_inertial_odometry.h"
#include "rio_t/odometry/scan_result.h"
#include "rio_t/ros/cloud/stamping.h"

namespace rio_t {

/// Whether the motion of the last second shows the time offset: its scans alone, without earlier knowledge,
/// would give the offset to kMaxSigma. At constant velocity they do not, even if the sigma of the estimate is
/// small.
class OffsetObservability {
 public:
  void add(const ScanResult& result);
  bool observable() const;

 private:
  static constexpr double kWindow = 1.0;     // [s]
  static constexpr double kMaxSigma = 0.02;  // [s] a fifth of a radar period: better than not knowing

  struct Sample {
    Time stamp;
    double information = 0.0;  // [1/s^2]
  };
  std::deque<Sample> samples_;  // oldest first
};

/// A trajectory of bounded memory that always reaches from the first pose to the last: once `capacity` poses
/// are kept, every second one goes, and from then on only every second (fourth, ...) is kept.
class BoundedTrajectory {
 public:
  /// `capacity` must be at least 2; throws std::invalid_argument.
  explicit BoundedTrajectory(std::size_t capacity);

  void add(const StampedPose& pose);
  /// The poses kept, and the last one added in any case.
  Trajectory poses() const;
  /// One pose in so many is kept: 1, 2, 4, ...
  std::size_t stride() const { return stride_; }

 private:
  bool lastIsKept() const { return (count_ - 1) % stride_ == 0; }

  std::size_t capacity_;  // read-only after construction
  Trajectory kept_;
  std::size_t stride_ = 1;
  std::size_t count_ = 0;  ///< poses added
  StampedPose last_;
};

/// The state of one run of the estimator. A reset makes a new session, so that nothing of the old one leaks
/// into it.
///
/// Three threads meet here: the IMU thread, the input thread (radars and triggers), and the optimisation
/// thread.
class LiveSession {
 public:
  using Clock = std::chrono::steady_clock;

  /// Scans that get no stamp.
  struct GivenUp {
    std::size_t radar = 0;
    std::string reason;
    std::uint64_t count = 0;
  };

  /// `options` is config.odometry with the extrinsics that hold. Radars are counted as in configsOfRadars.
  LiveSession(const Config& config, const OdometryOptions& options);

  /// IMU thread. Empty before the first optimised state.
  std::optional<NavigationState> addImu(const ImuMeasurement& imu);
  /// Any thread.
  void addPressure(const Pressure& pressure) { odometry_.addPressure(pressure); }
  /// Whether the optimisation thread has taken none of the last `kMaxWaitingImu` samples. It must be stuck,
  /// and the waiting samples would grow without bound. Any thread.
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

  /// A result of the estimator, and what the topics need besides.
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

  /// Returns the optimised poses so far: those that left the window, and the newest. Of more than
  /// `kMaxPoses`, only one in `stride` is kept.
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
  std::vector<ScanStamper> stampers_;  // by radar; guarded by stamper_mutex_

  std::map<ScanKey, Clock::time_point> arrivals_;  // guarded by stamper_mutex_

  std::vector<Radar> radars_;  // optimisation thread only

  mutable std::mutex start_mutex_;
  std::optional<RadarInertialOdometry::Start> start_;  // guarded by start_mutex_, as the next
  std::optional<WorldInOdom> world_;

  mutable std::mutex trajectory_mutex_;
  BoundedTrajectory left_window_{kMaxPoses};  // guarded by trajectory_mutex_, as the next
  std::optional<StampedPose> newest_;
};

/// Holds the current session of the live node. Once it is replaced, nothing of it is published. Thread-safe.
class CurrentSession {
 public:
  using Session = std::shared_ptr<LiveSession>;
  /// Who publishes. Each has a lock of its own, so that neither waits for the other.
  enum class Speaker { kNavigation, kOptimisation };

  /// Null before there is one.
  Session get() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return session_;
  }

  /// Replaces the session and returns the old one. Waits for those who publish; afterwards nobody publishes
  /// for the old session. It must not be called from within speak().
  Session replace(Session fresh) {
    const std::scoped_lock lock(speaking_[0], speaking_[1], mutex_);
    std::swap(session_, fresh);
    return fresh;
  }

  /// Calls say() if `session` is the current one, which it stays until say() returns. Returns whether it was.
  template <typename Say>
  bool speak(Speaker speaker, const Session& session, Say&& say) {
    const std::lock_guard<std::mutex> lock(speaking_[static_cast<std::size_t>(speaker)]);
    if (get() != session) return false;
    say();
    return true;
  }

 private:
  std::array<std::mutex, 2> speaking_;  // by Speaker
  mutable std::mutex mutex_;            // held for nanoseconds
  Session session_;                     // guarded by mutex_; changes with both of speaking_ held too
};

}  // namespace rio_t
