#include "rio_t/imu/noise_spectrum.h"

#include <algorithm>

namespace rio_t {
namespace {

/// [s] Between the scans of a slow radar. Means over longer times show motion rather than noise.
constexpr double kLongest = 0.1;

}  // namespace

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
