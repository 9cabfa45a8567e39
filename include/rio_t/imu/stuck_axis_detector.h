#pragma once

#include <optional>

#include "rio_t/core/time.h"

namespace rio_t {

/// [rad/s] No bias of a gyro is as large: the IMU turns.
constexpr double kTurns = 0.1;

/// Follows one axis of a gyro and finds a reading that sticks: it jumps away from one sample to the next, as
/// no mass can, and then stays there within its noise; or it jumps over a gap, or the IMU turns, and it
/// repeats itself to the last bit. Not thread-safe.
class StuckAxisDetector {
 public:
  /// Takes a reading [rad/s]. None if it may be used. Otherwise the most likely reading: the last good one,
  /// fading with the correlation time of the motion. Repeats count if the IMU `turns` about any axis, and if
  /// no axis is at the end of its range.
  std::optional<double> check(Time time, double reading, bool turns, bool is_saturated);

 private:
  std::optional<double> good_;  ///< the last reading that was used
  Time good_at_;
  std::optional<double> stuck_at_;  ///< the reading that jumped away or froze, while it repeats
  bool is_impossible_ = false;      ///< that jump, for any mass
  double usual_jump_ = 0.0;         ///< largest between neighbours lately [rad/s]
  std::optional<double> last_;
  double repeats_ = 0.0;      ///< of last_, to the last bit
  double longest_run_ = 0.0;  ///< of repeats lately
};

}  // namespace rio_t
