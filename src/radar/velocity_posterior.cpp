#include "velocity_posterior.h"

#include <Eigen/LU>
#include <cmath>

#include "direction_noise.h"
#include "doppler_bin.h"

namespace rio_t {
namespace {

constexpr int kMaxIterations = 10;
/// The search ends at a step that promises to lower the cost by less, a hundredth of a sigma.
constexpr double kNoProgress = 0.5e-4;

VelocityCost costAt(const Eigen::Vector3d& v_R, const DopplerLikelihood& likelihood,
                    const std::optional<VelocityPrior>& prior) {
  VelocityCost cost = likelihood.at(v_R);
  if (!prior) return cost;
  const Eigen::Matrix3d information = prior->covariance.inverse();
  const Eigen::Vector3d error = v_R - prior->v_R;
  cost.value += 0.5 * error.dot(information * error);
  cost.gradient += information * error;
  cost.information += information;
  return cost;
}

}  // namespace

// A point reads its bin, of width q, only while |d + u . v| < q/2. So v lies in the ellipsoid
// (v - v_0)' M (v - v_0) < q^2/4. A uniform density over an ellipsoid in 3D has the covariance
// M^-1 (q^2/4) / 5. More points do not help. Noise of the Doppler blurs the edge of the bin, and adds its
// variance.
double binInformation(double doppler_step, double doppler_variance) {
  return 1.0 / (square(doppler_step) / 20.0 + doppler_variance);
}

Eigen::Matrix3d meanOuterProduct(const std::vector<RadarDirection>& points) {
  Eigen::Matrix3d mean = Eigen::Matrix3d::Zero();
  for (const RadarDirection& p : points) mean += p.u_R * p.u_R.transpose();
  return mean / static_cast<double>(points.size());
}

LikeliestVelocity findLikeliest(const DopplerLikelihood& likelihood,
                                const std::optional<VelocityPrior>& prior, const Eigen::Vector3d& v_R) {
  LikeliestVelocity likeliest{v_R, costAt(v_R, likelihood, prior)};
  // At first a step may be as long as one point allows.
  double damping = 1.0 / (square(likelihood.halfBin()) / 3.0 + square(likelihood.smallestSigma()));
  for (int i = 0; i < kMaxIterations; ++i) {
    Eigen::Matrix3d damped = likeliest.cost.information;
    damped.diagonal().array() += damping;
    const Eigen::Vector3d step = -damped.inverse() * likeliest.cost.gradient;
    if (-0.5 * step.dot(likeliest.cost.gradient) < kNoProgress) break;
    const Eigen::Vector3d next_R = likeliest.v_R + step;
    const VelocityCost next = costAt(next_R, likelihood, prior);
    const bool is_better = next.value < likeliest.cost.value;
    damping *= is_better ? 0.1 : 10.0;
    if (is_better) likeliest = {next_R, next};
  }
  return likeliest;
}

VelocityPosterior findPosterior(const std::vector<RadarDirection>& points, const PointVariances& noise,
                                const std::optional<VelocityPrior>& prior, const Eigen::Vector3d& v_R) {
  const LikeliestVelocity likeliest = findLikeliest(DopplerLikelihood(points, v_R, noise), prior, v_R);
  const double step = std::sqrt(12.0 * noise.quantization);
  const Eigen::Matrix3d information =
      likeliest.cost.information +
      binInformation(step, noise.doppler + kMinDopplerVariance) * meanOuterProduct(points);
  return {likeliest.v_R, information.inverse()};
}

}  // namespace rio_t
