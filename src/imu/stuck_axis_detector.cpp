#include "rio_t/imu/stuck_axis_detector.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rio_t/imu/noise.h"

namespace rio_t {
namespace {

/// [rad/s] No platform that carries a radar changes its rate by so much within a sample: at 100 Hz that is
/// 200 rad/s^2, at 400 Hz 800 rad/s^2. A hand that shakes with 3 rad/s at 3 Hz reaches 60 rad/s^2.
constexpr double kSmallestJump = 2.0;
constexpr double kHandShakes = 60.0;  // [rad/s^2] of that hand
constexpr double kUnusual = 5.0;      // [usual jumps] above this a reading jumps away, below it is noise
/// Corrupt readings of up to 17 rad/s are within 2 rad/s of each other 12 times in 100, and four times in a
/// row once in 5000.
constexpr int kAgreeing = 4;
constexpr double kMemory = 10.0;  // [s] of the usual jump and the longest run
/// Fewer repeats show nothing: if the noise of a gyro is one step, five in a row come once in 600 samples.
constexpr double kFewRepeats = 10.0;
/// [s] A shorter run of repeats shows nothing: at the top of a swing of 1 rad/s^3, a reading stays in a step
/// of 0.06 degrees/s for 0.09 s.
constexpr double kShortRun = 0.1;
/// [longest recent runs] If r repeats come once in the 1000 samples of kMemory, 3 r come once in 10^9.
constexpr double kUnusualRun = 3.0;

double fade(double dt) { return std::exp(-std::max(0.0, dt) / kMemory); }

}  // namespace

bool FrozenAxisDetector::isFrozen(Time time, double reading, bool turns) {
  const bool is_last = last_ && *last_ == reading;
  const bool is_first = !last_;
  if (longest_run_) *longest_run_ *= fade(time - last_at_);
  last_ = reading;
  last_at_ = time;
  if (is_last) {
    repeats_ += 1.0;
    is_frozen_ |= turns && longest_run_ && time - run_since_ > kShortRun &&
                  repeats_ > std::max(kFewRepeats, kUnusualRun * *longest_run_);
    return is_frozen_;
  }
  if (!is_first && !is_frozen_) longest_run_ = std::max(longest_run_.value_or(0.0), repeats_);
  repeats_ = 0.0;
  run_since_ = time;
  is_frozen_ = false;
  return is_frozen_;
}

std::optional<double> StuckAxisDetector::check(Time time, double reading, bool turns, bool is_saturated) {
  const bool is_frozen = frozen_.isFrozen(time, reading, turns);
  if (!good_) {
    good_ = good_before_ = reading;
    good_at_ = time;
  }
  const double since = std::max(0.0, time - good_at_);
  // The last good one may be wrong: a wrong reading near the truth passes. So the one before it counts, too.
  const double jump = std::min(std::abs(reading - *good_), std::abs(reading - good_before_));
  const double unusual = kUnusual * usual_jump_;
  const double limit = std::max(kSmallestJump, unusual);
  const double from_last = std::abs(reading - std::exchange(last_, reading));
  const double from_stuck = stuck_at_ ? std::abs(reading - *stuck_at_) : 0.0;
  // After a jump that no mass makes, the noise of a stuck axis is no motion either.
  const bool stays =
      stuck_at_ && (is_impossible_ ? from_stuck <= unusual : from_stuck == 0.0 && agreeing_ == 0);
  // A reading that is far from the last wrong one is wrong, too.
  const bool jumps_away = jump > limit && (!stuck_at_ || from_stuck > limit);
  const bool freezes = !stuck_at_ && is_frozen && !is_saturated;
  if (jumps_away || freezes) {
    stuck_at_ = reading;
    last_jump_ = 0.0;
    agreeing_ = 0;
    is_impossible_ = jump > kHandShakes * since;
  }
  if (stays || freezes || (jumps_away && is_impossible_))
    return *good_ * std::exp(-since / kMotionCorrelationTime);
  // Over a gap the rate of a platform may change so much. Only if the reading then repeats, it sticks.
  if (jumps_away) return std::nullopt;
  if (stuck_at_ && jump > std::max(limit, kHandShakes * since)) {
    // A turn that goes on to change does not stick. But it may be the next wrong reading: good_ stays until a
    // platform can have come so far.
    stuck_at_ = reading;
    is_impossible_ = false;
    agreeing_ = 0;
    return std::nullopt;
  }
  agreeing_ = from_last <= limit ? std::min(agreeing_ + 1, kAgreeing) : 0;
  if (stuck_at_ && agreeing_ < kAgreeing) return std::nullopt;
  usual_jump_ = std::max(fade(since) * usual_jump_, last_jump_);
  last_jump_ = stuck_at_ ? 0.0 : jump;
  stuck_at_.reset();
  good_before_ = *good_;
  good_ = reading;
  good_at_ = time;
  return std::nullopt;
}

}  // namespace rio_t
