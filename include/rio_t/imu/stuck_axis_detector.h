#pragma once

#include <optional>

#include "rio_t/core/time.h"

namespace rio_t {

/// Follows one axis of a gyro and finds a reading that sticks: it jumps away from one sample to the next, as
/// no mass can, and then stays there within its noise; or it jumps over a gap and then repeats itself to the
/// last bit. Not thread-safe.
class StuckAxisDetector {
 public:
  /// Takes a reading [rad/s]. None if it may be used. Otherwise the most likely reading: the last good one,
  /// fading with the correlation time of the motion.
  std::optional<double> check(Time time, double reading);

 private:
  std::optional<double> good_;  ///< the last reading that was used
  Time good_at_;
  std::optional<double> stuck_at_;  ///< the reading that jumped away, while it repeats
  bool is_impossible_ = false;      ///< that jump, for any mass
  double usual_jump_ = 0.0;         ///< largest between neighbours lately [rad/s]
};

}  // namespace rio_t
