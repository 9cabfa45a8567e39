#include "rio_t/imu/clock_jump_detector.h"

namespace rio_t {

ClockJumpDetector::Verdict ClockJumpDetector::check(Time stamp) {
  const double step = newest_ ? stamp - *newest_ : 0.0;
  Verdict verdict = Verdict::kGood;
  if (newest_ && (step <= 0.0 || step > max_gap_)) {
    verdict = step > 0.0 ? Verdict::kAhead : Verdict::kBehind;
    const double onward = elsewhere_newest_ ? stamp - *elsewhere_newest_ : 0.0;
    if (onward <= 0.0 || onward > max_gap_) elsewhere_since_ = stamp;
    elsewhere_newest_ = stamp;
    if (stamp - *elsewhere_since_ < patience_) return verdict;
    verdict = Verdict::kRestart;
  }
  newest_ = stamp;
  elsewhere_since_.reset();
  elsewhere_newest_.reset();
  return verdict;
}

}  // namespace rio_t
