#pragma once

#include <diagnostic_updater/DiagnosticStatusWrapper.h>

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "rio_t/ros/live/session.h"

namespace rio_t {

/// Keeps the accounts of the live node and judges them, for `diagnostics`. Thread-safe.
class LiveMonitor {
 public:
  using Status = diagnostic_updater::DiagnosticStatusWrapper;

  explicit LiveMonitor(const Config& config) : config_(config) {}

  void imu();  ///< a message came, as the next
  void scan();
  void trigger();
  void odometry(double latency);  ///< ~odom was published that many seconds after the IMU message came
  void dropped(const std::string& reason,
               std::uint64_t count = 1);  ///< a scan or sample that goes no further
  void result(const LiveSession::Result& result);
  void solverFailed(const std::string& what);
  /// The session starts again; counters of the node go on.
  void reset(const std::string& reason);
  /// What is missing before there is a session at all; empty: nothing.
  void waitFor(const std::string& what);

  // The tasks. `session` is the running one, null before there is one.
  void describeOdometry(Status& status, const LiveSession* session) const;
  void describeInput(Status& status, const LiveSession* session);
  void describeSolver(Status& status, const LiveSession* session) const;
  void describeTimeOffset(Status& status) const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Latency {
    double worst = 0.0, sum = 0.0;  // [s]
    std::uint64_t count = 0;
    void add(double seconds);
  };
  struct Rate {
    std::uint64_t count = 0;
    std::uint64_t told = 0;  // count when the rate was last told
  };

  const Config config_;
  mutable std::mutex mutex_;  // guards all that follows
  Rate imu_, scans_, triggers_, odometry_;
  Clock::time_point told_ = Clock::now();
  Latency odometry_latency_, scan_latency_;
  std::map<std::string, std::uint64_t> dropped_;
  std::uint64_t used_ = 0, updates_ = 0, resets_ = 0, queue_full_told_ = 0;
  std::map<SolverTermination, std::uint64_t> terminations_;
  std::deque<SolverTermination> last_terminations_;  // of the last windows, newest last
  std::string last_reset_, waiting_for_, solver_failure_;
  std::optional<LiveSession::Result> last_update_;
  std::optional<Time> last_used_;  // stamp of the last scan used
  Time last_scan_;                 // stamp of the last scan finished
};

/// The warning for a person whose IMU is far noisier than the options say.
std::string noisyImu(const MeasuredImuNoise& noise, const ImuNoise& told);

}  // namespace rio_t
