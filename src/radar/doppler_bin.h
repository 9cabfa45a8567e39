#pragma once

#include <cmath>

namespace rio_t {

/// [m^2/s^2] Least variance of a Doppler: a point without noise would have infinite weight. It is a hundredth
/// of that of any radar known.
constexpr double kMinDopplerVariance = 1e-6;

/// Probability that a value with the error `e` and the noise `sigma` falls into a bin of half width
/// `half_bin` around it (docs/method.md, eq. 19a, times the width).
inline double binProbability(double e, double sigma, double half_bin) {
  const auto beyond = [&](double edge) { return 0.5 * std::erfc(edge / sigma * M_SQRT1_2); };
  const double size = std::abs(e);  // the bin is even, and erfc is exact in its upper tail only
  return beyond(size - half_bin) - beyond(size + half_bin);
}

/// Density of a Doppler of the static world, with the error `e` (docs/method.md, eq. 19a). `variance` is that
/// of Doppler and direction, `quantization` that of the bin. A bin that is narrower than the noise adds to
/// it.
inline double dopplerDensity(double e, double variance, double quantization) {
  const double half_bin = std::sqrt(3.0 * quantization);
  const double sigma = std::sqrt(variance);
  if (half_bin > sigma) return binProbability(e, sigma, half_bin) / (2.0 * half_bin);
  const double whole = variance + quantization;
  return std::exp(-0.5 * e * e / whole) / std::sqrt(2.0 * M_PI * whole);
}

}  // namespace rio_t
