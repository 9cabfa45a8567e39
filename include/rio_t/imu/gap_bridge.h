#pragma once

#include <optional>
#include <vector>

#include "rio_t/imu/measurement.h"
#include "rio_t/imu/noise.h"

namespace rio_t {

/// The most likely readings of the IMU over a gap, as samples like its own.
///
/// A straight line between both ends of a gap is good for some hundredths of a second. Over seconds it turns
/// the platform by its last rate times the gap. Gravity then has a wrong direction and throws the velocity
/// off by 10 m/s each second. Platforms turn to and fro instead. The expectation of a stationary Gauss-Markov
/// signal of correlation time tau, given its values r_0 and r_1 at both ends of a gap of T, is
///   r(t) = (r_0 sinh((T - t) / tau) + r_1 sinh(t / tau)) / sinh(T / tau).
/// This is the straight line for T << tau. For T >> tau, only gravity is left in the middle of the gap.
class GapBridge {
 public:
  /// Takes a sample, to know gravity in the IMU frame within about 1 m/s^2 when a gap begins.
  void follow(const ImuMeasurement& imu);
  /// Starts again without any sample.
  void reset() { newest_.reset(); }
  /// Samples between the last one taken and `next`, without those two. `is_bridge` is set, and the noise is
  /// that of `next`. None before the first sample.
  std::vector<ImuMeasurement> until(const ImuMeasurement& next) const;
  /// Reading of the accelerometer at rest in the current attitude [m/s^2], in the IMU frame.
  const Eigen::Vector3d& gravity() const { return gravity_I_; }

 private:
  std::optional<ImuMeasurement> newest_;
  Eigen::Vector3d gravity_I_ = Eigen::Vector3d::Zero();
};

}  // namespace rio_t
