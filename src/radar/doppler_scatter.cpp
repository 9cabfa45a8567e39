#include "doppler_scatter.h"

#include <cmath>

#include "direction_noise.h"
#include "doppler_bin.h"

namespace rio_t {
namespace {

/// [sigma] A normal variable is below it nine times in ten.
constexpr double kConfidence = 1.28;
constexpr int kDoublings = 10;  // of the variance: 32 times the sigma

/// Logarithm of the likelihood (docs/method.md, eq. 19a) of the points, as a function of the noise.
double logLikelihood(const PointVariances& noise, const std::vector<RadarDirection>& points,
                     const Eigen::Vector3d& v_R) {
  double sum = 0.0;
  for (const RadarDirection& p : points) {
    const double variance =
        kMinDopplerVariance + residualVariance(Angles(p.u_R), v_R, noise) - noise.quantization;
    sum += std::log(dopplerDensity(p.doppler + p.u_R.dot(v_R), variance, noise.quantization).value +
                    noise.outlier_density);
  }
  return sum;
}

}  // namespace

PointVariances withScatter(const PointVariances& told, const std::vector<RadarDirection>& points,
                           const Eigen::Vector3d& v_R) {
  if (points.size() <= 3) return told;  // they fit any velocity
  const double of_told = logLikelihood(told, points, v_R);
  PointVariances widest = told;
  double of_widest = of_told;
  for (int i = 0; i < kDoublings; ++i) {
    PointVariances wider = widest;
    wider.doppler = 2.0 * (widest.doppler + kMinDopplerVariance);
    const double of_wider = logLikelihood(wider, points, v_R);
    if (of_wider < of_widest) break;
    widest = wider;
    of_widest = of_wider;
  }
  return of_widest - of_told > 0.5 * kConfidence * kConfidence ? widest : told;
}

}  // namespace rio_t
