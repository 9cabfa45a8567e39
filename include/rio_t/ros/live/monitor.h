#pragma once

#include <diagnostic_updater/DiagnosticStatusWrapper.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "rio_t/ros/diagnosis/diagnosis.h"
#include "rio_t/ros/live/session.h"

namespace rio_t {

/// Keeps the accounts of the live node and judges them, for `diagnostics`. Radars are counted as in
/// configsOfRadars; keys of one radar begin with its name, as "left/scans", where the radars have names. The
/// rates of the topics are reported by tasks of diagnostic_updater beside it.
/// Thread-safe.
class LiveMonitor {
 public:
  using Status = diagnostic_updater::DiagnosticStatusWrapper;

  /// The state of the input, as ROS knows it.
  struct RosView {
    /// Types of what others publish, by topic: a topic of a wrong type brings no message. Needed only while
    /// lacksInput().
    std::map<std::string, std::string> topic_types;
    std::map<std::string, std::uint32_t> publishers;  ///< how many there are on each topic of the input
    Time now;                                         ///< ROS time
    bool clock_stands = false;  ///< ROS time comes from /clock, and has stood still since the last view
  };

  /// `config`: with the topics as they are resolved.
  explicit LiveMonitor(const Config& config);

  void imu();  ///< a message came, as the next
  void scan(std::size_t radar = 0);
  void trigger(std::size_t radar = 0);
  void zeroTrigger(std::size_t radar);  ///< one with a stamp of zero, which stamps no scan
  /// A state was ready `latency` seconds after the callback of its IMU message began.
  void odometry(const NavigationState& state, double latency);
  void imuDropped(const std::string& reason);  ///< a sample that goes no further
  void imuUsable(Time stamp);                  ///< the last message moves the estimate
  void imuUnusable(const std::string& why);    ///< it does not
  /// Scans, or points of them, that go no further.
  void dropped(std::size_t radar, const std::string& reason, std::uint64_t count = 1);
  void padding(std::size_t radar, std::uint64_t points);  ///< that its clouds are filled up with
  void pressure();                                        ///< a message came
  void pressureDropped(const std::string& why);           ///< one that cannot be used
  void result(const LiveSession::Result& result);
  /// The session starts again; counters of the node go on.
  void reset(const std::string& reason);
  bool wasReset() const;
  /// Sets what the node waits for before its first session. An empty text means nothing.
  void waitFor(const std::string& what);
  /// Texts about the frames, by key.
  void setFrames(const std::map<std::string, std::string>& frames);
  /// Whether nothing came yet on a topic of the IMU, of a radar or of the barometer.
  bool lacksInput() const;
  void setRosView(RosView view);
  void tune(const ImuNoise& configured);  ///< the noise of the IMU as it is configured now
  /// A change of parameters was refused, for that reason; or was made, if it is empty.
  void reconfigured(const std::string& refused_because);

  // The tasks. `session` is the running one, null before there is one.
  void describeOdometry(Status& status, const LiveSession* session);
  void describeInput(Status& status, const LiveSession* session);
  void describeSolver(Status& status) const;
  /// For a node with use_sim_time and no /clock for so many seconds, after describeInput: nothing can come.
  /// Until `kClockPatience`, the player of a bag may still wait, as rio_t.launch lets it: that is no fault.
  /// Returns whether it is one.
  static bool describeMissingClock(Status& status, double seconds);
  static constexpr double kClockPatience = 10.0;  ///< [s] more than the delay of the player in rio_t.launch
  void describeTimeOffset(Status& status, std::size_t radar = 0) const;
  void describeExtrinsics(Status& status, std::size_t radar = 0) const;
  void describeBarometer(Status& status);
  void describeGroundVehicle(Status& status) const;
  void describeLandmarks(Status& status) const;

 private:
  struct Latency {
    double worst = 0.0, sum = 0.0;  // [s]
    std::uint64_t count = 0;
    void add(double seconds);
  };
  struct Counter {
    std::uint64_t count = 0;
    std::uint64_t reported = 0;  // the count at the last call
    std::size_t calls = 0;       // in a row, to which the count stood still

    /// Whether it stood still to this call and to the `at_least` - 1 before it.
    bool isSilent(std::size_t at_least) {
      calls = std::exchange(reported, count) == count ? calls + 1 : 0;
      return calls >= at_least;
    }
  };
  /// The calls come once a second. A radar or a barometer may send as seldom, and then misses a call at
  /// times.
  static constexpr std::size_t kSilentCalls = 2;

  struct Barometer : BarometerCounts {
    Counter messages;
    std::uint64_t not_usable = 0, used_reported = 0;
    std::string why_not_usable;  ///< of the last one
  };

  /// How many scans of a radar were usable, used and dropped.
  struct Account {
    std::uint64_t usable = 0, used = 0;
    std::map<std::string, std::uint64_t> dropped;
  };
  struct Radar {
    explicit Radar(Config its_config) : config(std::move(its_config)) {}

    Config config;
    Counter scans, triggers;
    std::map<std::string, std::uint64_t> dropped;
    std::uint64_t used = 0;
    std::uint64_t early = 0;  ///< scans that came before they could be used
    std::optional<LiveSession::Result> last_update;
    std::deque<Account> accounts;  ///< as of the last calls of describeInput, newest last
  };
  /// A fault; `level` is that of diagnostic_msgs/DiagnosticStatus.
  struct Finding {
    std::uint8_t level = 0;
    std::string text;
  };

  /// "the radar" or "radar left", for texts.
  static std::string called(const Radar& radar);
  /// Adds what the input has of this radar, and returns what is wrong with it.
  std::optional<Finding> describeRadar(Status& status, Radar& radar, bool initialized) const;
  /// How few of its last scans were used, and why, if it is less than half.
  static std::optional<std::string> judgeUse(Radar& radar, bool initialized);
  /// Says how many scans were used between these accounts, and why most others were not.
  static std::string useBetween(const Account& then, const Account& now);
  /// Says for each radar why its scans are not used any more; begins with "; ".
  std::string whyCoasting() const;
  /// Whether scans are used, and each is then too old to count as one.
  bool usesScansLate() const;
  /// Adds whether the run is good so far and, if not, why. Writes the likeliest reason to `why`.
  Diagnosis addDiagnosis(Status& status, const LiveSession& session, std::string* why) const;
  /// For the end of a message about a topic on which nothing came: its type, if it is wrong; if nobody
  /// publishes it, the topics of the right type.
  std::string whatIsPublished(const std::string& topic, const std::string& expected) const;
  /// Whether this radar gave an estimate lately.
  bool isRecent(const Radar& radar) const;

  mutable std::mutex mutex_;  // guards all that follows
  Config config_;
  std::vector<Radar> radars_;
  EvidenceCollector collector_;  // since the session started
  Counter imu_;
  Counter usable_imu_;             ///< messages that move the estimate
  std::optional<Time> imu_stamp_;  ///< of the last of them
  std::string why_unusable_;       ///< of the last other message
  std::string imu_fault_;  ///< why no odometry comes, as of the last call of describeInput; empty: it comes
  std::size_t calls_not_good_ = 0;  ///< of describeOdometry, in which the verdict was not good
  std::uint64_t imu_before_session_ = 0, not_usable_before_session_ = 0;
  Barometer barometer_;
  Latency odometry_latency_, scan_latency_;
  std::map<std::string, std::uint64_t> imu_dropped_;
  std::uint64_t updates_ = 0, resets_ = 0, queue_full_reported_ = 0;
  std::map<SolverTermination, std::uint64_t> terminations_;
  std::deque<SolverTermination> last_terminations_;  // of the last windows, newest last
  std::string last_reset_, waiting_for_, refused_because_;
  std::uint64_t reconfigurations_ = 0;
  std::map<std::string, std::string> frames_;
  RosView ros_;
  std::optional<LiveSession::Result> last_update_;
  std::optional<Time> last_used_;                // stamp of the last scan used
  double age_of_used_ = 0.0;                     // [s] of that scan, when it was used
  std::optional<NavigationState> newest_state_;  // at the newest IMU sample
};

/// Why an IMU message that cannot be read goes no further. The bag runner names it so, too.
constexpr const char* kImuNotUsable = "imu_not_usable";

/// The warning for a person whose IMU is far noisier than the options say.
std::string noisyImu(const MeasuredImuNoise& noise, const ImuNoise& configured);

}  // namespace rio_t
