#pragma once

#include "rio_t/core/time.h"

namespace rio_t {

/// Scale of the model errors relative to the options. NoiseMeter and PointNoise measure the noise of IMU and
/// points. The other errors are scale and misalignment of the IMU, and errors that the points of a scan
/// share; the options `imu_accel_noise_density` and `ego_velocity_added_sigma` stand for these. This factor
/// multiplies both squares, so that the innovations of the radar match their covariances: the variance factor
/// of adjustment theory (Mikhail and Ackermann, Observations and Least Squares, 1976) for a part of the
/// noise, by Fisher scoring, one innovation a step (docs/method.md, eq. 32a). Not thread-safe.
class ModelErrorScale {
 public:
  /// Takes an innovation of 3 axes at `stamp`: its squared length in sigmas, 3 on average if the scale is
  /// right, and the share of its variance that the scale multiplies. Old innovations fade.
  void add(Time stamp, double squared_sigmas, double share);
  double value() const { return value_; }  ///< of the squares; 1 to begin with

 private:
  double value_ = 1.0;
  Time last_;
  double information_ = 0.0;  ///< of the scale's logarithm, fading
};

}  // namespace rio_t
