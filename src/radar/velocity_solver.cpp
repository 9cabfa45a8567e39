#include "velocity_solver.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "direction_noise.h"
#include "likeliest_velocity.h"

namespace rio_t {
namespace {

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
  known.outlier_density = kMinOutlierDensity;  // RANSAC has left them out
  // The scan alone tells how far it spreads: an object in a corner of the view must not pass for the world.
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
