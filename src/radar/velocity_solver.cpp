#include "velocity_solver.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "direction_noise.h"

namespace rio_t {
namespace {

constexpr int kMaxIterations = 10;
/// If the next step is expected to lower the cost by less than this, it is the last one. It is then a tenth
/// of a sigma, over which the likelihood is quadratic.
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

using SymmetricEigen = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>;

double degreesOfFreedom(std::size_t points) { return points > 3 ? static_cast<double>(points - 3) : 1.0; }

bool isWellConditioned(const SymmetricEigen& eigen, const EgoVelocityOptions& options) {
  return eigen.eigenvalues()[0] * options.max_condition_number > eigen.eigenvalues()[2];
}

Eigen::Matrix3d inverseOf(const SymmetricEigen& eigen) {
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() *
         eigen.eigenvectors().transpose();
}

/// How the angles of these points spread, noise included.
AngleSpread spreadOf(const std::vector<double>& angles) {
  const auto n = static_cast<double>(angles.size());
  AngleSpread spread{std::accumulate(angles.begin(), angles.end(), 0.0) / n, 0.0, 0.0};
  for (const double angle : angles) spread.variance += square(angle - spread.mean) / (n - 1.0);
  spread.within = spread.variance;
  return spread;
}

}  // namespace

LikeliestVelocity findLikeliest(const DopplerLikelihood& likelihood,
                                const std::optional<VelocityPrior>& prior, const Eigen::Vector3d& v_R) {
  Eigen::Vector3d best_R = v_R;
  VelocityCost cost = costAt(v_R, likelihood, prior);
  // At first a step may be about as long as the sigma of one point.
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

double largestSigma(const Eigen::Matrix3d& covariance) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(eigen.eigenvalues()[2]);
}

VelocitySolution solveLeastSquares(const std::vector<RadarDirection>& points,
                                   const EgoVelocityOptions& options) {
  VelocitySolution solution;
  if (points.size() < 3) return solution;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const RadarDirection& p : points) {
    normal += p.u_R * p.u_R.transpose();
    right -= p.u_R * p.doppler;
  }
  SymmetricEigen eigen;
  eigen.computeDirect(normal);
  if (!isWellConditioned(eigen, options)) return solution;
  const Eigen::Matrix3d inverse = inverseOf(eigen);
  solution.v_R = inverse * right;
  double squares = 0.0;
  for (const RadarDirection& p : points) squares += square(p.doppler + p.u_R.dot(solution.v_R));
  const double variance =
      std::max(squares / degreesOfFreedom(points.size()), square(options.doppler_quantization) / 12.0);
  solution.covariance = variance * inverse;
  solution.solved = true;
  return solution;
}

VelocitySolution solveLikelihood(const std::vector<RadarDirection>& points, const PointVariances& noise,
                                 const Eigen::Vector3d& v_R, const EgoVelocityOptions& options) {
  PointVariances known = noise;
  known.outlier_density = kMinOutlierDensity;  // RANSAC has removed the outliers
  // The spread is that of this scan alone, or an object in a corner of the view could pass for the world.
  known.azimuths = spreadOf(anglesOf(points, azimuthOf));
  known.elevations = spreadOf(anglesOf(points, elevationOf));
  const LikeliestVelocity likeliest = findLikeliest(DopplerLikelihood(points, v_R, known), std::nullopt, v_R);
  const double squares = 2.0 * likeliest.cost;  // in sigmas
  const double wider = std::max(1.0, squares / degreesOfFreedom(points.size()));
  return solutionOf(likeliest.v_R, likeliest.information / wider, options);
}

VelocitySolution solutionOf(const Eigen::Vector3d& v_R, const Eigen::Matrix3d& information,
                            const EgoVelocityOptions& options) {
  VelocitySolution solution;
  SymmetricEigen eigen;
  eigen.computeDirect(information);
  if (!isWellConditioned(eigen, options)) return solution;
  solution.v_R = v_R;
  solution.covariance = inverseOf(eigen);
  solution.solved = true;
  return solution;
}

}  // namespace rio_t
