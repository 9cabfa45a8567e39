#pragma once

#include <atomic>
#include <cmath>
#include <limits>

#include "rio_t/core/time.h"

namespace rio_t {

/// Thins out a stream by its stamps: the first message of each period is published. The periods count from
/// the epoch, so the same stamps give the same choice, whenever one starts. `set` may be called from any
/// thread, `isDue` from one.
class PublishRate {
 public:
  explicit PublishRate(double hz) : hz_(hz) {}
  void set(double hz) { hz_ = hz; }  ///< [Hz] 0: every message

  bool isDue(Time stamp) {
    const double hz = hz_;
    if (hz <= 0.0) return true;
    const double period = std::floor(stamp.seconds() * hz);
    if (period == last_) return false;
    last_ = period;
    return true;
  }

 private:
  std::atomic<double> hz_;
  double last_ = std::numeric_limits<double>::quiet_NaN();  ///< period of the last message; NaN equals none
};

}  // namespace rio_t
