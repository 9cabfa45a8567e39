#pragma once

#include <cmath>

namespace rio_t {

/// [m^2/s^2] Least variance of a Doppler: a point without noise would have infinite weight. It is a hundredth
/// of that of any radar known.
constexpr double kMinDopplerVariance = 1e-6;

/// Probability that a value with the error `z` falls into a bin of half width `half` around it, both in
/// sigmas of the noise (docs/method.md, eq. 19a, times the width).
inline double binProbability(double z, double half) {
  const auto beyond = [](double edge) { return 0.5 * std::erfc(edge * M_SQRT1_2); };
  const double size = std::abs(z);  // the bin is even, and erfc is exact in its upper tail only
  return beyond(size - half) - beyond(size + half);
}

/// Density of a Doppler of the static world, and its derivative by the variance.
struct DopplerDensity {
  double value, by_variance;
};

/// `e` is the error of the Doppler (docs/method.md, eq. 19a). `variance` is that of Doppler and direction,
/// `quantization` that of the bin. A bin that is narrower than the noise adds to it.
inline DopplerDensity dopplerDensity(double e, double variance, double quantization) {
  const double half_bin = std::sqrt(3.0 * quantization);
  const double sigma = std::sqrt(variance);
  if (half_bin > sigma) {
    const auto byVariance = [&](double edge) {  // of the probability beyond it
      return edge * std::exp(-0.5 * edge * edge / variance) / (std::sqrt(8.0 * M_PI) * sigma * variance);
    };
    return {binProbability(e / sigma, half_bin / sigma) / (2.0 * half_bin),
            (byVariance(e - half_bin) - byVariance(e + half_bin)) / (2.0 * half_bin)};
  }
  const double whole = variance + quantization;
  const double value = std::exp(-0.5 * e * e / whole) / std::sqrt(2.0 * M_PI * whole);
  return {value, value * 0.5 * (e * e - whole) / (whole * whole)};
}

/// Fisher information of a Doppler about `variance`, averaged over the place of the velocity in the bin. A
/// bin that is wider than the noise has information near its edges only: the integral over z of z^2 phi(z)^2
/// / (8 Phi(z) Phi(-z)) is 0.276.
inline double varianceInformation(double variance, double quantization) {
  const double half_bin = std::sqrt(3.0 * quantization);
  const double sigma = std::sqrt(variance);
  if (half_bin > sigma) return 0.276 / (half_bin * sigma * variance);
  const double whole = variance + quantization;
  return 0.5 / (whole * whole);
}

}  // namespace rio_t
