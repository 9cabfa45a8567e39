#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "rio_t/ros/live/monitor.h"
#include "rio_t/ros/live/session.h"

namespace rio_t {

/// Logs the input and the estimate of the live node. A line that would come with each message comes at most
/// once in a period. Thread-safe, but for `faults`.
class LiveLog {
 public:
  /// `name`: of the node, at the beginning of each line.
  explicit LiveLog(std::string name) : name_(std::move(name)) {}

  /// Logs `text` if no line of this kind came within `period` [s]; returns whether it did. Unlike ROS's
  /// throttles, each radar can have a kind of its own.
  bool warn(const std::string& kind, const std::string& text, double period = kPeriod);
  bool error(const std::string& kind, const std::string& text, double period = kPeriod);

  /// Calls `callback`. Logs an exception: no message may end the node or reset the estimate.
  template <typename Callback>
  void guarded(const std::string& what, Callback&& callback) {
    try {
      callback();
    } catch (const std::exception& fault) {
      error(what, what + ": " + fault.what());
    }
  }

  /// Logs a status of the diagnostics, if it is not OK.
  void status(const LiveMonitor::Status& status);
  void health(const ScanResult& result);
  /// Logs what the session's counters of faults have counted since the last call, but for what `health` logs.
  /// Call it always from the same thread.
  void faults(const std::shared_ptr<LiveSession>& session);
  /// Logs the step and the span of a radar's Doppler, if they differ from those reported.
  void doppler(const Config& radar, const RadarKnowledge& now, RadarKnowledge* reported) const;

 private:
  static constexpr double kPeriod = 5.0;  // [s]

  bool isTimeToTell(const std::string& kind, double period);

  const std::string name_;
  std::mutex mutex_;
  std::map<std::string, std::chrono::steady_clock::time_point> told_at_;  // guarded by mutex_

  std::map<std::string, std::uint64_t> faults_told_;  // thread of `faults` only, as the next
  std::weak_ptr<LiveSession> faults_of_;              // whose faults these are
};

}  // namespace rio_t
