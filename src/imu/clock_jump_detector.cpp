#include "rio_t/imu/clock_jump_detector.h"

#include <algorithm>

namespace rio_t {
namespace {

/// [intervals] A stamp goes on from a run of stamps if it follows within this time. After n >= 2 messages
/// that others overtook, the next stamp is n + 1 intervals later.
constexpr double kGoesOn = 2.0;

}  // namespace

ClockJumpDetector::Verdict ClockJumpDetector::check(Time stamp) {
  const double step = newest_ ? stamp - *newest_ : 0.0;
  Verdict verdict = Verdict::kGood;
  if (newest_ && (step <= 0.0 || step > std::min(patience_, max_gap_))) {
    verdict = step > 0.0 ? Verdict::kAhead : Verdict::kBehind;
    const double onward = elsewhere_ ? stamp - elsewhere_->newest : 0.0;
    const bool goes_on = 0.0 < onward && onward <= max_gap_;
    if (!goes_on) elsewhere_ = StampRun{stamp, stamp};
    elsewhere_->newest = stamp;
    ++elsewhere_->count;
    const bool is_gap = goes_on && step > 0.0 && step <= max_gap_;
    if (!is_gap && stamp - elsewhere_->first < patience_) return verdict;
    verdict = is_gap ? Verdict::kGood : Verdict::kRestart;
  }
  stepped_back_ = verdict == Verdict::kGood ? stepBackBefore(stamp) : 0.0;
  before_newest_ = verdict == Verdict::kGood ? newest_ : std::nullopt;
  newest_ = stamp;
  elsewhere_.reset();
  return verdict;
}

double ClockJumpDetector::stepBackBefore(Time stamp) const {
  if (!elsewhere_ || elsewhere_->count < 2 || elsewhere_->newest > *newest_) return 0.0;
  // Only the newest stamp was ahead. The stamps behind it go on from the one before it.
  if (before_newest_ && elsewhere_->first > *before_newest_) return 0.0;
  const double interval = (elsewhere_->newest - elsewhere_->first) / (elsewhere_->count - 1);
  return stamp - elsewhere_->newest < kGoesOn * interval ? stamp - elsewhere_->first : 0.0;
}

}  // namespace rio_t
