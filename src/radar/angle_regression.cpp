#include "angle_regression.h"

#include <cmath>
#include <numeric>

#include "direction_noise.h"

namespace rio_t {
namespace {

/// Share of a variance that is not noise.
double trueShare(double variance, double noise) { return variance > noise ? 1.0 - noise / variance : 0.0; }

/// The variance about the mean of this scan, as this scan and earlier ones show it together.
double varianceWithin(const std::vector<double>& angles, double mean, const AngleSpread& spread) {
  if (!std::isfinite(spread.within_freedom)) return spread.within;
  double squares = spread.within_freedom * spread.within;
  for (const double angle : angles) squares += square(angle - mean);
  return squares / (spread.within_freedom + static_cast<double>(angles.size()) - 1.0);
}

}  // namespace

AngleRegression::AngleRegression(const std::vector<double>& measured, double noise,
                                 const AngleSpread& spread) {
  const auto n = static_cast<double>(measured.size());
  scan_mean_ = std::accumulate(measured.begin(), measured.end(), 0.0) / n;
  mean_ = scan_mean_;
  remaining_ = noise;
  if (!std::isfinite(spread.variance)) return;
  const double within = varianceWithin(measured, scan_mean_, spread);
  share_ = trueShare(within, noise);
  // The mean of true^2 grows with the measured angle by the third moment over `within`. The square of the
  // expected angle grows by share^2 times that. Noise without skewness does not change the third moment.
  growth_ = (1.0 - square(share_)) * spread.skewness * std::sqrt(within);
  const double of_means = spread.variance - spread.within + spread.within / n;
  const double mean_share = trueShare(of_means, noise / n);
  mean_ = spread.mean + mean_share * (scan_mean_ - spread.mean);
  remaining_ = noise * (share_ * (1.0 - 1.0 / n) + mean_share / n);
}

double AngleRegression::shortening(double measured) const {
  return std::exp(-0.5 * (remaining_ + growth_ * (measured - scan_mean_)));
}

}  // namespace rio_t
