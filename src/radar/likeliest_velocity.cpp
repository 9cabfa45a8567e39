#include "likeliest_velocity.h"

#include <Eigen/LU>

#include "direction_noise.h"

namespace rio_t {
namespace {

constexpr int kMaxIterations = 10;
/// A step that promises to lower the cost by less is the last one: a tenth of a sigma, over which the
/// likelihood is quadratic.
constexpr double kLittleProgress = 0.5e-2;

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

LikeliestVelocity findLikeliest(const DopplerLikelihood& likelihood,
                                const std::optional<VelocityPrior>& prior, const Eigen::Vector3d& v_R) {
  Eigen::Vector3d best_R = v_R;
  VelocityCost cost = costAt(v_R, likelihood, prior);
  // At first a step may be as long as one point allows.
  double damping = 1.0 / (square(likelihood.halfBin()) / 3.0 + square(likelihood.smallestSigma()));
  for (int i = 0; i < kMaxIterations; ++i) {
    Eigen::Matrix3d damped = cost.information;
    damped.diagonal().array() += damping;
    const Eigen::Vector3d step = -damped.inverse() * cost.gradient;
    if (-0.5 * step.dot(cost.gradient) < kLittleProgress) {
      best_R += step;
      cost.value += step.dot(cost.gradient + 0.5 * cost.information * step);
      break;
    }
    const VelocityCost next = costAt(best_R + step, likelihood, prior);
    const bool is_better = next.value < cost.value;
    damping *= is_better ? 0.1 : 10.0;
    if (!is_better) continue;
    best_R += step;
    cost = next;
  }
  return {best_R, cost.value, cost.information + likelihood.binInformation()};
}

}  // namespace rio_t
