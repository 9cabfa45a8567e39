#pragma once

#include <optional>

#include "rio_t/core/time.h"

namespace rio_t {

/// [rad/s] Above this rate the IMU turns: no bias of a gyro is as large.
constexpr double kTurns = 0.1;

/// Follows one axis and finds a reading that freezes: while the IMU turns, it repeats itself to the last bit,
/// far more often in a row than recently, for a tenth of a second or longer. An axis without noise that
/// has never moved is not frozen. Not thread-safe.
class FrozenAxisDetector {
 public:
  /// `turns`: whether the IMU turns, about any axis. An axis stays frozen until its reading changes.
  bool isFrozen(Time time, double reading, bool turns);

 private:
  std::optional<double> last_;
  Time last_at_;
  double repeats_ = 0.0;               ///< of last_
  Time run_since_;                     ///< time of the first of these readings
  std::optional<double> longest_run_;  ///< of recent repeats; none while the axis has read only one value
  bool is_frozen_ = false;
};

/// Follows one axis of a gyro and finds wrong readings. One that sticks jumps away from one sample to the
/// next, as no mass can, and then stays there within its noise; or it jumps over a gap and then repeats
/// itself; or it freezes. One that is corrupt jumps to and fro. Not thread-safe.
class StuckAxisDetector {
 public:
  /// Takes a reading [rad/s]. Returns none if it may be used. Otherwise returns the most likely reading: the
  /// last good one, fading with the correlation time of the motion. A saturated gyro does not freeze.
  std::optional<double> check(Time time, double reading, bool turns, bool is_saturated);

 private:
  std::optional<double> good_;  ///< the last reading that is no jump, or agrees with others
  double good_before_ = 0.0;    ///< the one before it
  Time good_at_;
  std::optional<double> stuck_at_;  ///< the last reading that jumped away or froze; none once others agree
  bool is_impossible_ = false;      ///< whether no mass can make that jump
  int agreeing_ = 0;   ///< readings since then that are near good_ and the one before; at most kAgreeing
  double last_ = 0.0;  ///< [rad/s] the last reading of all
  double usual_jump_ = 0.0;  ///< largest recent one between neighbours [rad/s]
  double last_jump_ = 0.0;   ///< that of good_, which is usual if the next reading is good, too
  FrozenAxisDetector frozen_;
};

}  // namespace rio_t
