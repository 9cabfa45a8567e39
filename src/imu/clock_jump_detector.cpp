#include "rio_t/imu/clock_jump_detector.h"

#include <algorithm>

namespace rio_t {

ClockJumpDetector::Verdict ClockJumpDetector::check(Time stamp) {
  const double step = newest_ ? stamp - *newest_ : 0.0;
  Verdict verdict = Verdict::kGood;
  if (newest_ && (step <= 0.0 || step > std::min(patience_, max_gap_))) {
    verdict = step > 0.0 ? Verdict::kAhead : Verdict::kBehind;
    const double onward = elsewhere_newest_ ? stamp - *elsewhere_newest_ : 0.0;
    const bool goes_on = 0.0 < onward && onward <= max_gap_;
    if (!goes_on) elsewhere_since_ = stamp;
    elsewhere_newest_ = stamp;
    const bool is_gap = goes_on && step > 0.0 && step <= max_gap_;
    if (!is_gap && stamp - *elsewhere_since_ < patience_) return verdict;
    verdict = is_gap ? Verdict::kGood : Verdict::kRestart;
  }
  newest_ = stamp;
  elsewhere_since_.reset();
  elsewhere_newest_.reset();
  return verdict;
}

}  // namespace rio_t
