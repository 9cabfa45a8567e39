#include "velocity_solver.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "direction_noise.h"

namespace rio_t {
namespace {

double degreesOfFreedom(std::size_t points) { return points > 3 ? static_cast<double>(points - 3) : 1.0; }

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
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(normal);
  if (!(eigen.eigenvalues()[0] * options.max_condition_number > eigen.eigenvalues()[2])) return solution;
  const Eigen::Matrix3d inverse = eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() *
                                  eigen.eigenvectors().transpose();
  solution.v_R = inverse * right;
  double squares = 0.0;
  for (const RadarDirection& p : points) squares += square(p.doppler + p.u_R.dot(solution.v_R));
  const double variance =
      std::max(squares / degreesOfFreedom(points.size()), square(options.doppler_quantization) / 12.0);
  solution.covariance = variance * inverse;
  solution.solved = true;
  return solution;
}

// A measured direction u_m = u + e turns the residual d + u_m . v into Doppler noise plus e . v, and adds the
// covariance of e to u u' in H'H. Weights meet the first, MomentCorrection undoes the second. Estimating
// equation:
//   sum w_i ( U_i d_i + Q_i v ) = 0,   E[U_i] = u_i,  E[Q_i] = u_i u_i',  w_i = 1 / var_i,
// an unbiased score, so the estimate is consistent (Carroll et al., Measurement Error in Nonlinear Models,
// ch. 7; Fuller, Measurement Error Models, section 2.2). Two details matter:
// - The weights are those of the direction corrected by its own residual. The measured direction correlates
//   with its residual, and weights taken there bias the estimate (by 0.3 % of the speed at 2.5 m/s). The
//   corrected direction does not correlate, to first order.
// - Fuller's modification reduces the compensation by the share 1/n. Without it the estimate has no moments.
VelocitySolution solveErrorsInVariables(const std::vector<RadarDirection>& points, const Eigen::Vector3d& v_R,
                                        const PointVariances& given, const EgoVelocityOptions& options) {
  constexpr int kIterations = 3;

  VelocitySolution solution;
  const auto n = static_cast<double>(points.size());
  if (points.size() < 3) return solution;
  PointVariances noise = given;
  // Without any noise given the weights are equal; their size cancels.
  noise.quantization = std::max(noise.quantization, 1e-12);
  const double fuller = 1.0 - 1.0 / n;
  const MomentCorrection correct(fuller * noise.azimuth, fuller * noise.elevation);

  Eigen::Vector3d v = v_R;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Matrix3d score = Eigen::Matrix3d::Zero();  // covariance of the score
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const RadarDirection& p : points) {
      const Angles measured(p.u_R);
      const Angles corrected = correctedDirection(p.u_R, p.doppler + p.u_R.dot(v), v, noise);
      const double weight = 1.0 / residualVariance(corrected, v, noise);

      const Eigen::Vector3d u = correct.direction(measured);
      const Eigen::Matrix3d uu = correct.outerProduct(measured);
      const Eigen::Vector3d compensation = u * u.dot(v) - uu * v;
      normal += weight * uu;
      right -= weight * p.doppler * u;
      score += weight * u * u.transpose() + square(weight) * compensation * compensation.transpose();
    }
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
    eigen.computeDirect(normal);
    solution.solved = eigen.eigenvalues()[0] * options.max_condition_number > eigen.eigenvalues()[2];
    if (!solution.solved) return solution;
    const Eigen::Matrix3d inverse = eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() *
                                    eigen.eigenvectors().transpose();
    v = inverse * right;
    solution.covariance = inverse * score * inverse;
  }

  // Residuals larger than promised widen the covariance.
  double chi2 = 0.0;
  for (const RadarDirection& p : points)
    chi2 += square(p.doppler + p.u_R.dot(v)) / residualVariance(Angles(p.u_R), v, noise);
  solution.covariance *= std::max(1.0, chi2 / degreesOfFreedom(points.size()));
  solution.v_R = v;
  return solution;
}

}  // namespace rio_t
