#pragma once

#include <deque>
#include <optional>

#include "rio_t/odometry/radar_inertial_odometry.h"

namespace rio_t {

/// Whether the motion of the last second says something about the time offset.
///
/// A scan sees v(s - t_O), so one with covariance sigma_v^2 tells t_O with information |dv/dt|^2 / sigma_v^2,
/// v being the velocity in the body frame. Summed over that second; enough where that alone, without what was
/// known before, gives the offset to kMaxSigma. At constant velocity it gives nothing, however small the
/// estimate's own sigma.
class OffsetObservability {
 public:
  /// Feeds one result; only those that are `updated` are read.
  void add(const ScanResult& result);
  bool observable() const;

 private:
  static constexpr double kWindow = 1.0;     // [s]
  static constexpr double kMaxSigma = 0.02;  // [s] a fifth of a radar period: better than not knowing

  struct Sample {
    Time time;
    double information = 0.0;  // [1/s^2]
  };

  std::deque<Sample> samples_;  // oldest first
  std::optional<NavigationState> previous_;
};

}  // namespace rio_t
