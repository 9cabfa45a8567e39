#include "rio_t/factors/doppler_factor.h"

#include <algorithm>
#include <cmath>

namespace rio_t {
namespace {

/// [sigma of a point] Within this distance e, an expansion of second order replaces the points. Its error is
/// about (e / sigma)^3 / 6.
constexpr double kNear = 0.1;
/// Limit of the expansions that find the shared error. With a few less, the cost depended on where the last
/// expansion was, and a batch of the real bag did not converge.
constexpr int kMaxExpansions = 20;

VelocityCost moved(const VelocityCost& cost, const Eigen::Vector3d& by) {
  const Eigen::Vector3d H_by = cost.information * by;
  return {cost.value + cost.gradient.dot(by) + 0.5 * by.dot(H_by), cost.gradient + H_by, cost.information};
}

/// As withSharedError, with Huber's loss: beyond `threshold` sigma, the variances grow with the shared error.
VelocityCost withRobustSharedError(const VelocityCost& cost, const Eigen::Vector3d& variances,
                                   double threshold, Eigen::Vector3d& error) {
  double scale = 1.0;
  for (int i = 0;; ++i) {
    VelocityCost result = withSharedError(cost, scale * variances, &error);
    const double sigmas = std::sqrt((error.cwiseAbs2().array() / variances.array().max(1e-12)).sum());
    const double next = threshold > 0.0 ? std::max(1.0, sigmas / threshold) : 1.0;
    if (std::abs(next - scale) < 0.01 * scale || i == 20) {
      if (scale > 1.0)
        result.value += 0.5 * (2.0 * threshold * sigmas - threshold * threshold - sigmas * sigmas / scale);
      return result;
    }
    scale = next;
  }
}

}  // namespace

VelocityCost DopplerFactor::costAt(const Eigen::Vector3d& v_R) const {
  Eigen::Vector3d error = Eigen::Vector3d::Zero();
  if (!expansion_.v_R.allFinite()) expansion_ = {v_R, points_->at(v_R)};
  for (int i = 0;; ++i) {
    VelocityCost cost = withRobustSharedError(moved(expansion_.cost, v_R - expansion_.v_R), shared_variances_,
                                              huber_threshold_, error);
    const Eigen::Vector3d away = v_R + error - expansion_.v_R;
    if (away.norm() < kNear * points_->smallestSigma() || i == kMaxExpansions) return cost;
    expansion_ = {v_R + error, points_->at(v_R + error)};
  }
}

bool DopplerFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const PredictedVelocity predicted = model_.at(parameters, jacobians != nullptr);
  const VelocityCost cost = costAt(predicted.v_R);
  const Eigen::Matrix3d U = semidefiniteRoot(cost.information);
  const Eigen::Vector3d r = solveTransposed(U, cost.gradient);
  Eigen::Map<Eigen::Vector4d>{residuals} << r, std::sqrt(std::max(0.0, 2.0 * cost.value - r.squaredNorm()));
  if (jacobians == nullptr) return true;
  Eigen::Matrix<double, 4, 3> by_v_R;
  by_v_R << U, Eigen::RowVector3d::Zero();  // the misfit does not depend on it
  store(by_v_R * predicted.J_motion, jacobians[0]);
  store(by_v_R * predicted.J_biases, jacobians[1]);
  store(by_v_R * predicted.dv_dt_O, jacobians[2]);
  store(by_v_R * predicted.J_extrinsics, jacobians[3]);
  return true;
}

}  // namespace rio_t
