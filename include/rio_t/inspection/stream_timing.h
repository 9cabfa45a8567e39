#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "rio_t/core/time.h"

namespace rio_t {

/// When a message was stamped, and when it was recorded. The two clocks may differ.
struct MessageTimes {
  Time stamp, record;
};

/// How the messages of one topic come.
struct StreamTiming {
  std::size_t messages = 0;
  /// [Hz] of the median interval of the stamps, or of the records if they tell nothing; of bursts, the mean.
  double rate = 0.0;
  /// Messages of a burst, if nearly all the time passes between bursts of stamps; else 0. The driver stamps
  /// them when it reads them, and no gap between bursts is a loss.
  double burst = 0.0;
  double burst_period = 0.0;   ///< [s] from burst to burst
  std::size_t zero = 0;        ///< stamps of zero
  bool constant = false;       ///< all stamps are the same, and not zero
  std::size_t duplicates = 0;  ///< stamps as the one before
  std::size_t backwards = 0;   ///< stamps before the one before
  std::size_t gaps = 0;        ///< intervals above 3.5 times the median, and above 20 ms
  double longest_gap = 0.0;    ///< [s]
  double jitter = 0.0;         ///< [s] half of the inner two thirds of the intervals' scatter

  bool stampsAreUsable() const { return zero == 0 && !constant && 10 * backwards < messages; }
};

/// `times` in the order of the records.
StreamTiming inspectTiming(const std::vector<MessageTimes>& times);

/// Arrival against the stamp, both in the IMU clock [s].
struct StreamDelay {
  double median = 0.0, most = 0.0;  ///< most: of nine in ten
};

/// The delays of a topic beyond those of the IMU. The smallest difference between record and stamp of the IMU
/// messages that were recorded just before a message carries its record time over into the IMU clock. None if
/// hardly any message has such neighbours: then the topics were written one after the other. Both must not be
/// empty, in the order of the records. One stamp of the IMU that is ahead would decide, so leave out those
/// that are out of place.
std::optional<StreamDelay> delayAgainstImu(const std::vector<MessageTimes>& times,
                                           const std::vector<MessageTimes>& imu);

}  // namespace rio_t
