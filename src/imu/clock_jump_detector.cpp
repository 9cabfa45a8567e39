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
    const double onward = elsewhere_newest_ ? stamp - *elsewhere_newest_ : 0.0;
    const bool goes_on = 0.0 < onward && onward <= max_gap_;
    if (!goes_on) {
      elsewhere_since_ = stamp;
      elsewhere_ = 0;
    }
    elsewhere_newest_ = stamp;
    ++elsewhere_;
    const bool is_gap = goes_on && step > 0.0 && step <= max_gap_;
    if (!is_gap && stamp - *elsewhere_since_ < patience_) return verdict;
    verdict = is_gap ? Verdict::kGood : Verdict::kRestart;
  }
  stepped_back_ = verdict == Verdict::kGood ? stepBackBefore(stamp) : 0.0;
  before_newest_ = verdict == Verdict::kGood ? newest_ : std::nullopt;
  newest_ = stamp;
  elsewhere_since_.reset();
  elsewhere_newest_.reset();
  elsewhere_ = 0;
  return verdict;
}

double ClockJumpDetector::stepBackBefore(Time stamp) const {
  if (elsewhere_ < 2 || *elsewhere_newest_ > *newest_) return 0.0;
  // Only the newest stamp was ahead. The stamps behind it go on from the one before it.
  if (before_newest_ && *elsewhere_since_ > *before_newest_) return 0.0;
  const double interval = (*elsewhere_newest_ - *elsewhere_since_) / (elsewhere_ - 1);
  return stamp - *elsewhere_newest_ < kGoesOn * interval ? stamp - *elsewhere_since_ : 0.0;
}

}  // namespace rio_t
