#include "rio_t/imu/noise_spectrum.h"

#include <algorithm>

namespace rio_t {
namespace {

/// [s] Between the scans of a slow radar. Means over longer times show motion rather than noise.
constexpr double kLongest = 0.1;

}  // namespace

void NoiseSpectrum::add(Time time, const Eigen::Vector3d& value) {
  Time at = time;
  Eigen::Vector3d mean = value;
  for (Rate& rate : rates_) {
    rate.meter.add(at, mean);
    rate.has_first = !rate.has_first;
    if (rate.has_first) {
      rate.first_time = at;
      rate.first = mean;
      return;
    }
    at = rate.first_time + 0.5 * (at - rate.first_time);
    mean = 0.5 * (rate.first + mean);
  }
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
