#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "noise.h"
#include "rio_t/core/time.h"

namespace rio_t {

/// One axis of an IMU in a hand: swings, white noise, the low pass of the sensor, a range and 16 bits.
class LowPassedAxis {
 public:
  /// `rate` [Hz]; `range` [unit] of the reading; `density` [unit/sqrt(Hz)] of the noise.
  LowPassedAxis(double rate, double range, double density, std::uint32_t seed)
      : rate_(rate), range_(range), sigma_(density * std::sqrt(kOversampled * rate)), random_(seed) {
    for (double& phase : phases_) phase = random_.uniform(0.0, 2.0 * M_PI);
  }

  Time time() const { return Time::fromSeconds(count_ / rate_); }  ///< of the last reading
  bool isAtEnd() const { return std::abs(reading_) >= range_; }

  /// The next reading, of swings `size` times as large as those of a hand: the sum is up to 2.7 `size`.
  double next(double size) {
    // Two poles: the noise has only as much of the fast as the sensor lets pass.
    const double keep = std::exp(-2.0 * M_PI * kBandwidth / (kOversampled * rate_));
    for (int i = 0; i < kOversampled; ++i) {
      slow_ = keep * slow_ + (1.0 - keep) * sigma_ * random_.normal();
      noise_ = keep * noise_ + (1.0 - keep) * slow_;
    }
    const double t = ++count_ / rate_;
    double swing = 0.0;
    for (std::size_t i = 0; i < kSizes.size(); ++i)
      swing += kSizes[i] * std::sin(2.0 * M_PI * kFrequencies[i] * t + phases_[i]);
    const double step = range_ / 32768.0;
    reading_ = std::round(std::clamp(size * swing + noise_, -range_, range_) / step) * step;
    return reading_;
  }

 private:
  static constexpr int kOversampled = 4;
  static constexpr double kBandwidth = 41.0;  // [Hz]
  static constexpr std::array<double, 4> kSizes{1.0, 0.8, 0.6, 0.3}, kFrequencies{0.4, 0.9, 1.7, 2.6};

  double rate_, range_, sigma_;
  Random random_;
  std::array<double, 4> phases_{};
  double slow_ = 0.0, noise_ = 0.0, reading_ = 0.0;
  int count_ = 0;
};

}  // namespace rio_t
