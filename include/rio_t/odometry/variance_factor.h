#pragma once

#include "rio_t/core/time.h"

namespace rio_t {

/// How far the noise of radar and accelerometer is from what the options say: the variance factor (variance
/// of unit weight) of adjustment theory, e.g. Mikhail and Ackermann, Observations and Least Squares, 1976.
/// Both noises are multiplied by it, so that no weight changes against another, but every covariance is what
/// the scans show. Noise of the gyro, priors and random walks stay as told. Not thread-safe.
class VarianceFactor {
 public:
  /// An innovation of 3 axes at `stamp`, and its squared length in sigmas as if the factor were 1: 3 on the
  /// mean where the options are right. Old innovations fade.
  void add(Time stamp, double squared_sigmas);
  /// 1 to begin with.
  double value() const;

 private:
  Time last_;
  double squares_ = 0.0;  ///< fading sum of squared_sigmas / 3
  double count_ = 0.0;    ///< the same sum of ones
};

}  // namespace rio_t
