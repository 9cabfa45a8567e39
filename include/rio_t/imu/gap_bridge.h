#pragma once

#include <optional>
#include <vector>

#include "rio_t/imu/measurement.h"

namespace rio_t {

/// For how long platforms keep their rate of turn and their acceleration [s]: the autocorrelation of the
/// gyros of a hand-held rig falls to 1/e in 0.5 to 0.7 s.
constexpr double kMotionCorrelationTime = 0.5;

/// What the IMU most likely read where it said nothing, as samples like its own.
///
/// A straight line between both ends of a gap will do for some hundredths of a second. Over seconds it turns
/// the platform by whatever rate it had when the IMU fell silent, times the gap, and gravity, in a wrong
/// direction from then on, throws the velocity off by 10 m/s each second. Platforms turn to and fro instead:
/// the expectation of a stationary Gauss-Markov signal of correlation time tau, given its values r_0 and r_1
/// at both ends of a gap of T, is
///   r(t) = (r_0 sinh((T - t) / tau) + r_1 sinh(t / tau)) / sinh(T / tau),
/// the straight line for T << tau, and nothing but gravity in the middle of T >> tau.
class GapBridge {
 public:
  /// `imu` is taken: to know gravity in the IMU frame, within about a m/s^2, where a gap begins.
  void follow(const ImuMeasurement& imu);
  /// Starts again, as if nothing had been followed.
  void reset() { newest_.reset(); }
  /// Samples between the last one that was followed and `next`, without those two; `is_bridge` is set, doubts
  /// are those of `next`. None before the first sample.
  std::vector<ImuMeasurement> until(const ImuMeasurement& next) const;

 private:
  std::optional<ImuMeasurement> newest_;
  Eigen::Vector3d gravity_I_ = Eigen::Vector3d::Zero();  ///< what rest would read now [m/s^2]
};

}  // namespace rio_t
