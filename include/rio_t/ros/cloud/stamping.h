#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "rio_t/radar/scan.h"
#include "rio_t/ros/parameters/config.h"

namespace rio_t {

/// Converts times of receipt (or recording) to the IMU clock. A message is received after it was stamped. So
/// the smallest difference between the two is the difference of the clocks plus the shortest delay of the
/// IMU. The minimum is over the last one to two minutes, so that it follows clocks that drift. If the
/// differences stay far above it, one of the clocks has jumped, and the minimum starts again.
class ClockMap {
 public:
  void add(Time stamp, Time record);
  /// None before the first sample.
  std::optional<Time> toImuClock(Time record) const;

 private:
  static constexpr std::int64_t kNothing = std::numeric_limits<std::int64_t>::max();
  std::int64_t smallest_ns_ = kNothing;         // record minus stamp, of the current minute
  std::int64_t smallest_before_ns_ = kNothing;  // of the minute before
  Time minute_begin_;                           // in the IMU clock
  int far_above_ = 0;                           // samples in a row
};

struct StampingOptions {
  StampSource source = StampSource::kHeader;
  double shift = 0.0;       ///< [s] added to every stamp
  std::string radar_topic;  ///< for messages, as is trigger_topic
  std::string trigger_topic;
};
StampingOptions stampingOptions(const Config& config);

/// Gives scans their stamps in the IMU clock. It knows no ROS node: the live node and the bag runner feed it
/// what they receive, in the order of receipt. "record" is the time of receipt or recording; it may run on
/// another clock than the stamps.
///
/// header: the stamp of the cloud.
/// arrival: the time of receipt, which ClockMap converts.
/// trigger: the stamp of the scan's trigger, found
///  - by `seq`, if one trigger with the scan's seq was recorded between kMaxDelay before the scan and
///    kMaxOvertake after it (kMaxDelay after it, once it is known that triggers and scans count alike);
///  - else, once it is clear that they do not count alike, by time: the trigger nearest to the header's
///    stamp, within half a trigger period; if that stamp is zero, the latest that was recorded before the
///    scan.
///  A scan waits kMaxDelay for its trigger, or kMaxOvertake once a later trigger has come.
///  While a scan waits, the scans after it wait, too, so that the order is kept.
///  A scan whose trigger never comes is given up and counted. A trigger serves only one scan.
/// A scan is also given up if its shifted stamp is below zero or later than a message can hold.
class ScanStamper {
 public:
  static constexpr double kMaxDelay = 0.5;      ///< [s] from a trigger to its scan, both as recorded
  static constexpr double kMaxOvertake = 0.05;  ///< [s] that a trigger may be recorded after its scan
  static constexpr std::size_t kMaxHeld = 50;   ///< scans that may wait

  explicit ScanStamper(StampingOptions options);

  void addImu(Time stamp, Time record);
  /// Throws std::runtime_error, naming topic and key, for a zero `stamp`; that trigger is left out.
  void addTrigger(std::uint32_t seq, Time stamp, Time record);
  /// `scan.stamp` is not read. Throws std::runtime_error, naming the topic and the other sources, for a zero
  /// `header_stamp` with stamp_source header; that scan is left out, others may follow.
  void addScan(std::uint32_t seq, Time header_stamp, Time record, RadarScan scan);

  /// Scans that have their stamp now, in the order of receipt.
  std::vector<RadarScan> take();
  /// Call it at the end of the data: decides about the scans that still wait.
  std::vector<RadarScan> finish();

  /// How many scans were given up since the last call, by reason: "trigger_missing", "imu_missing",
  /// "too_many_held" or "stamp_out_of_range".
  std::map<std::string, std::uint64_t> takeGivenUp() { return std::exchange(given_up_, {}); }

 private:
  struct Trigger {
    std::uint32_t seq = 0;
    Time stamp, record;
    bool used = false;
  };
  struct Held {
    std::uint32_t seq = 0;
    Time header_stamp, record;
    RadarScan scan;
  };
  enum class Decision { kStamped, kWait, kGiveUp };
  enum class Counting { kUnknown, kAlike, kUnlike };  // whether triggers and scans have the same seq

  Decision stampFront(Time* stamp);
  Decision stampFromTrigger(const Held& scan, Time* stamp);
  Decision stampFromTriggerTime(const Held& scan, Time* stamp);
  Trigger* triggerOfSeq(const Held& scan);
  std::optional<double> triggerPeriod() const;
  void advanceTo(Time record);  // sets now_
  /// The clock of the records was set back to `record`: shifts the records of what waits by the same step.
  void followStepBack(Time record);
  void giveUp(const std::string& reason);

  const StampingOptions options_;
  ClockMap clocks_;
  std::deque<Trigger> triggers_;  // the last ones, oldest first
  std::deque<Held> held_;         // oldest first
  std::map<std::string, std::uint64_t> given_up_;
  std::optional<Time> first_record_, newest_imu_record_;
  Time now_;  // latest record time seen
  bool finishing_ = false;
  Counting counting_ = Counting::kUnknown;
  std::size_t unmatched_ = 0;  // scans in a row that should have found their seq, and did not
};

}  // namespace rio_t
