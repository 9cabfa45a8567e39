#pragma once

#include <optional>

#include "rio_t/core/time.h"

namespace rio_t {

/// Follows the stamps of a sensor. Distinguishes a single wrong stamp from a clock that jumped, after which
/// the stamps go on from the new time. After a gap longer than `patience`, the first stamp is dropped and the
/// second confirms the gap. After a single wrong stamp ahead, all later stamps would be behind it until the
/// clock seems to have jumped. Not thread-safe.
class ClockJumpDetector {
 public:
  enum class Verdict {
    kGood,     ///< later than the one before, by no more than `max_gap`
    kBehind,   ///< drop it: not later than the newest good one
    kAhead,    ///< drop it: later by more than `max_gap`, or by more than `patience` and alone so far
    kRestart,  ///< the clock jumped: this stamp is good, earlier ones belong to another time
  };

  /// `max_gap` [s] between good stamps; `patience` [s] of stamps elsewhere that make a jump.
  ClockJumpDetector(double max_gap, double patience) : max_gap_(max_gap), patience_(patience) {}
  Verdict check(Time stamp);
  /// The newest good stamp.
  const std::optional<Time>& newest() const { return newest_; }
  /// [s] by which the clock had stepped back before the newest good stamp; else 0. Its samples were dropped.
  double steppedBack() const { return stepped_back_; }

 private:
  /// Stamps that go on from each other.
  struct StampRun {
    Time first, newest;
    int count = 0;
  };
  double stepBackBefore(Time stamp) const;

  double max_gap_;                              // read-only after construction, as the next
  double patience_;                             // [s]
  std::optional<Time> newest_, before_newest_;  // good ones, of one clock
  std::optional<StampRun> elsewhere_;           // the newest run of dropped stamps
  double stepped_back_ = 0.0;                   // [s]
};

}  // namespace rio_t
