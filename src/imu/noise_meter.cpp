#include "rio_t/imu/noise_meter.h"

#include <algorithm>
#include <cmath>

namespace rio_t {
namespace {

/// [s] over which the noise is averaged: long against a footstep, short against a change of speed of a motor.
constexpr double kMemory = 1.0;
/// Spacings that differ by more than this share are no run of equally spaced samples.
constexpr double kUnequal = 0.3;
constexpr double kVarianceGain = 70.0;  // 1 + 16 + 36 + 16 + 1
/// A square counts at most this many times the mean: four sigma. A knock is not noise, and a vibration that
/// begins still multiplies the mean within a few hundredths of a second.
constexpr double kLargestSquare = 16.0;
/// [unit^2/Hz] Less is rounding: a thousandth of what the best sensors of this kind show.
constexpr double kNothing = 1e-10;

}  // namespace

void NoiseMeter::add(Time time, const Eigen::Vector3d& value) {
  const double spacing = time - newest_;
  if (count_ > 1 && std::abs(spacing - spacing_) > kUnequal * spacing_) count_ = 0;
  if (count_ == 5) {
    std::rotate(last_.begin(), last_.begin() + 1, last_.end());
    --count_;
  }
  last_[static_cast<std::size_t>(count_++)] = value;
  newest_ = time;
  spacing_ = spacing;
  if (count_ < 5) return;

  const Eigen::Vector3d difference = last_[0] - 4.0 * last_[1] + 6.0 * last_[2] - 4.0 * last_[3] + last_[4];
  Eigen::Vector3d squares = difference.cwiseAbs2() * (spacing / kVarianceGain);
  const double mean = squaredDensity();
  // A signal that stood still to the last bit has no mean to compare with.
  if (mean > kNothing && weight_ * spacing > kMemory / 2.0) squares = squares.cwiseMin(kLargestSquare * mean);
  const double fade = std::exp(-spacing / kMemory);
  squares_ = fade * squares_ + squares;
  weight_ = fade * weight_ + 1.0;
}

}  // namespace rio_t
