#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>

#include "rio_t/core/time.h"

namespace rio_t {

/// Measures the white noise of a three-axis signal from the signal itself, at rest and in motion.
///
/// A platform moves smoothly from sample to sample; noise and vibration do not. The fourth divided difference
/// of five samples removes every cubic in time (docs/method.md, eq. 11b). Only noise is left in it, whatever
/// the spacing of the samples. Not thread-safe.
class NoiseMeter {
 public:
  /// Takes one sample [unit] at `time`; times must increase. Returns the part of the squared density that is
  /// too large for noise and does not count, of the noisiest axis [unit^2/Hz]: a knock. Five differences
  /// contain a single wrong value. The integral of the returned density over them is the square of what the
  /// value adds to the integral of the signal.
  double add(Time time, const Eigen::Vector3d& value);
  /// Squared density of the noisiest axis over the last second, or 25 samples [unit^2/Hz]; 0 before the first
  /// five samples.
  double squaredDensity() const { return weight_ > 0.0 ? squares_.maxCoeff() / weight_ : 0.0; }
  double spacing() const { return spacing_; }  ///< of the samples [s]
  /// Whether the density is a mean over at least half of the averaging time.
  bool isSettled() const { return weight_ * spacing_ > memory() / 2.0; }
  /// Begins again with five new samples, e.g. after a wrong one.
  void interrupt() { count_ = 0; }

 private:
  /// [s] over which the noise is averaged: long against a footstep, short against a change of speed of a
  /// motor.
  static constexpr double kMemory = 1.0;
  /// [samples] The mean is over at least so many: a slow sensor needs more time.
  static constexpr double kFewest = 25.0;
  double memory() const { return std::max(kMemory, kFewest * spacing_); }

  struct Sample {
    Time time;
    Eigen::Vector3d value = Eigen::Vector3d::Zero();
  };
  /// Squared density that five samples show, per axis [unit^2/Hz]; `spacing` is their mean spacing [s].
  Eigen::Vector3d squaredDensities(double spacing) const;

  std::array<Sample, 5> last_ = {};  ///< oldest first
  double spacing_ = 0.0;
  int count_ = 0;                                      ///< of `last_` that are in use
  Eigen::Vector3d squares_ = Eigen::Vector3d::Zero();  ///< fading sum, in squared densities
  double weight_ = 0.0;                                ///< the same sum of ones
};

/// The noise of a three-axis signal at the rate of its samples, and at a half, a quarter, ... of it.
///
/// White noise has the same density at all these rates. A vibration has less at the lower ones: it averages
/// out. Motion has more. Preintegration uses the smallest density (docs/method.md, 4.3). Not thread-safe.
class NoiseSpectrum {
 public:
  /// As in NoiseMeter. Returns the knock at the rate of the samples.
  double add(Time time, const Eigen::Vector3d& value);
  void interrupt();
  double squaredDensity() const { return rates_.front().meter.squaredDensity(); }  ///< of the samples
  /// The smallest density of all rates down to 10 Hz. It is never above that of the samples.
  double squaredDensityOfMeans() const;

 private:
  struct Rate {
    NoiseMeter meter;
    bool has_first = false;  ///< its mean with the next sample goes to the next rate
    Time first_time;
    Eigen::Vector3d first = Eigen::Vector3d::Zero();
  };
  std::array<Rate, 9> rates_ = {};  ///< the last of an IMU of 2560 Hz is 10 Hz
};

}  // namespace rio_t
