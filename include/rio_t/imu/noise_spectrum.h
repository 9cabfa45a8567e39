#pragma once

#include <Eigen/Core>
#include <array>

#include "rio_t/core/time.h"
#include "rio_t/imu/noise_meter.h"

namespace rio_t {

/// The noise of a three-axis signal at the rate of its samples, and at a half, a quarter, ... of it.
///
/// White noise has the same density at all these rates. A vibration has less at the lower ones: it averages
/// out. Motion has more. Preintegration uses the smallest density (docs/method.md, 4.3). Not thread-safe.
class NoiseSpectrum {
 public:
  /// As in NoiseMeter; the knock is that of the samples.
  double add(Time time, const Eigen::Vector3d& value);
  void interrupt();
  double squaredDensity() const { return rates_.front().meter.squaredDensity(); }  ///< of the samples
  /// The smallest density of all rates down to 10 Hz. It is never above that of the samples.
  double squaredDensityOfMeans() const;

 private:
  struct Rate {
    NoiseMeter meter;
    bool has_first = false;  ///< of the two whose mean goes to the next rate
    Time first_time;
    Eigen::Vector3d first = Eigen::Vector3d::Zero();
  };
  std::array<Rate, 9> rates_ = {};  ///< the last of an IMU of 2560 Hz is 10 Hz
};

}  // namespace rio_t
