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

/// How regularly the messages of one topic come.
struct StreamTiming {
  std::size_t messages = 0;
  /// [Hz] from the median interval of the stamps, or of the records if the stamps are useless. With bursts,
  /// the mean rate.
  double rate = 0.0;
  /// Messages per burst, if nearly all the time passes between bursts of stamps; else 0. The driver stamps
  /// the messages when it reads them, so no gap between bursts is a loss.
  double burst = 0.0;
  double burst_period = 0.0;   ///< [s] from burst to burst
  std::size_t zero = 0;        ///< stamps of zero
  bool constant = false;       ///< all stamps are the same, and not zero
  std::size_t duplicates = 0;  ///< stamps equal to the one before
  std::size_t backwards = 0;   ///< stamps earlier than the one before
  std::size_t gaps = 0;        ///< intervals above 3.5 times the median, and above 20 ms
  double longest_gap = 0.0;    ///< [s]
  double jitter = 0.0;         ///< [s] half the width of the middle two thirds of the intervals

  bool stampsAreUsable() const { return zero == 0 && !constant && 10 * backwards < messages; }
};

/// `times` in the order of the records.
StreamTiming inspectTiming(const std::vector<MessageTimes>& times);

/// Time from the stamp to the arrival of a message, both in the IMU clock [s].
struct StreamDelay {
  double median = 0.0, most = 0.0;  ///< most: nine in ten are shorter
};

/// Returns the delays of a topic beyond those of the IMU. The smallest difference between record and stamp of
/// the last few IMU messages before a message converts its record time to the IMU clock. None if hardly any
/// message has IMU messages near it: then the topics were recorded one after the other. Neither list may be
/// empty, and both are in the order of the records. A single IMU stamp that is ahead would decide, so leave
/// out stamps that are out of place.
std::optional<StreamDelay> delayAgainstImu(const std::vector<MessageTimes>& times,
                                           const std::vector<MessageTimes>& imu);

}  // namespace rio_t
