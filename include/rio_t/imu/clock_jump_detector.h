#pragma once

#include <optional>

#include "rio_t/core/time.h"

namespace rio_t {

/// Follows the stamps of a sensor and tells a sample that is out of place from a clock that jumped: the first
/// stands alone, after the second the stamps go on from where they jumped to. Not thread-safe.
class ClockJumpDetector {
 public:
  enum class Verdict {
    kGood,     ///< later than the one before, by no more than `max_gap`
    kBehind,   ///< to be dropped: not later than the newest good one
    kAhead,    ///< to be dropped: later by more than `max_gap`
    kRestart,  ///< the clock jumped: this stamp is good, all before belong to another time
  };

  /// `max_gap` [s] between good stamps; `patience` [s] of stamps elsewhere that make a jump.
  ClockJumpDetector(double max_gap, double patience) : max_gap_(max_gap), patience_(patience) {}
  Verdict check(Time stamp);

 private:
  double max_gap_;   // read-only after construction, as the next
  double patience_;  // [s]
  std::optional<Time> newest_;
  std::optional<Time> elsewhere_since_,
      elsewhere_newest_;  ///< of the stamps dropped since the newest good one
};

}  // namespace rio_t
