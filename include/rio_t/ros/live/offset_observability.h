#pragma once

#include <deque>

#include "rio_t/odometry/scan_result.h"

namespace rio_t {

/// Whether the motion of the last second tells the time offset: its scans alone, without what was known
/// before, would give the offset to kMaxSigma. At constant velocity they do not, however small the
/// estimate's own sigma.
class OffsetObservability {
 public:
  void add(const ScanResult& result);
  bool observable() const;

 private:
  static constexpr double kWindow = 1.0;     // [s]
  static constexpr double kMaxSigma = 0.02;  // [s] a fifth of a radar period: better than not knowing

  struct Sample {
    Time stamp;
    double information = 0.0;  // [1/s^2]
  };
  std::deque<Sample> samples_;  // oldest first
};

}  // namespace rio_t
