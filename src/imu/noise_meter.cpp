#include "rio_t/imu/noise_meter.h"

#include <algorithm>
#include <cmath>

namespace rio_t {
namespace {

/// [s] Longest spacing of the means, that of a slow radar. Longer means show motion rather than noise.
constexpr double kLongest = 0.1;

/// A square counts at most this many times the mean: four sigma. A knock is not noise, and a vibration that
/// begins still multiplies the mean within a few hundredths of a second.
constexpr double kLargestSquare = 16.0;
/// [unit^2/Hz] Less is rounding: a thousandth of what the best sensors of this kind show.
constexpr double kNothing = 1e-10;

}  // namespace

Eigen::Vector3d NoiseMeter::squaredDensities(double spacing) const {
  Eigen::Vector3d difference = Eigen::Vector3d::Zero();
  double gain = 0.0;
  std::array<double, 5> at{};  // [spacings]
  for (std::size_t i = 1; i < at.size(); ++i) at[i] = (last_[i].time - last_[0].time) / spacing;
  for (std::size_t i = 0; i < at.size(); ++i) {
    double product = 1.0;
    for (std::size_t j = 0; j < at.size(); ++j)
      if (j != i) product *= at[i] - at[j];
    const double weight = 1.0 / product;
    difference += weight * last_[i].value;
    gain += weight * weight;
  }
  return difference.cwiseAbs2() * (spacing / gain);
}

double NoiseMeter::add(Time time, const Eigen::Vector3d& value) {
  if (count_ == 5) {
    std::rotate(last_.begin(), last_.begin() + 1, last_.end());
    --count_;
  }
  last_[static_cast<std::size_t>(count_++)] = {time, value};
  if (count_ < 5) return 0.0;

  spacing_ = (last_[4].time - last_[0].time) / 4.0;
  const Eigen::Vector3d shown = squaredDensities(spacing_);
  const double mean = squaredDensity();
  // Without a mean to compare with, as after a constant signal, every square counts in full.
  const bool can_tell = mean > kNothing && isSettled();
  const Eigen::Vector3d squares = can_tell ? shown.cwiseMin(kLargestSquare * mean).eval() : shown;
  const double fade = std::exp(-(time - last_[3].time) / memory());
  squares_ = fade * squares_ + squares;
  weight_ = fade * weight_ + 1.0;
  return (shown - squares).maxCoeff();
}

double NoiseSpectrum::add(Time time, const Eigen::Vector3d& value) {
  Time at = time;
  Eigen::Vector3d mean = value;
  double knock = 0.0;
  for (Rate& rate : rates_) {
    const double of_means = rate.meter.add(at, mean);
    if (&rate == &rates_.front()) knock = of_means;
    rate.has_first = !rate.has_first;
    if (rate.has_first) {
      rate.first_time = at;
      rate.first = mean;
      return knock;
    }
    at = rate.first_time + 0.5 * (at - rate.first_time);
    mean = 0.5 * (rate.first + mean);
  }
  return knock;
}

void NoiseSpectrum::interrupt() {
  for (Rate& rate : rates_) {
    rate.meter.interrupt();
    rate.has_first = false;
  }
}

double NoiseSpectrum::squaredDensityOfMeans() const {
  double smallest = squaredDensity();
  for (const Rate& rate : rates_) {
    if (!rate.meter.isSettled() || rate.meter.spacing() > kLongest) break;
    smallest = std::min(smallest, rate.meter.squaredDensity());
  }
  return smallest;
}

}  // namespace rio_t
