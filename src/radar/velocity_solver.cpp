#include "velocity_solver.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace rio_t {
namespace {

double square(double a) { return a * a; }

/// Azimuth and elevation of a unit vector, by their sines and cosines.
struct Angles {
  explicit Angles(const Eigen::Vector3d& u) : sin_el(u.z()), cos_el(std::hypot(u.x(), u.y())) {
    // Straight up or down has no azimuth; any will do, since its derivatives vanish there.
    sin_az = cos_el > 1e-9 ? u.x() / cos_el : 0.0;
    cos_az = cos_el > 1e-9 ? u.y() / cos_el : 1.0;
  }
  Eigen::Vector3d byAzimuth() const { return {cos_az * cos_el, -sin_az * cos_el, 0.0}; }        // du/daz
  Eigen::Vector3d byElevation() const { return {-sin_el * sin_az, -sin_el * cos_az, cos_el}; }  // du/del
  double sin_el, cos_el, sin_az, cos_az;
};

double quantizationVariance(const EgoVelocityOptions& o) { return square(o.doppler_quantization) / 12.0; }

/// The part of a residual's variance that does not come from the quantisation.
double noiseVariance(const Angles& a, const Eigen::Vector3d& v_R, const EgoVelocityOptions& o) {
  return square(o.doppler_sigma) + square(o.azimuth_sigma * a.byAzimuth().dot(v_R)) +
         square(o.elevation_sigma * a.byElevation().dot(v_R));
}

/// Turns moments of a measured direction into unbiased moments of the true one.
///
/// With azimuth error N(0, sa^2), E[cos(k az_measured)] = exp(-k^2 sa^2 / 2) cos(k az), the same for sines
/// and for elevation; and u and u u' are made of such terms with k = 1, 2. So u and u u' can be undone
/// exactly, which subtracts the noise's share from H'H, and with it the attenuation of the least-squares
/// velocity.
class MomentCorrection {
 public:
  /// Noise variances of azimuth and elevation [rad^2].
  MomentCorrection(double azimuth_variance, double elevation_variance)
      : az1_(std::exp(0.5 * azimuth_variance)),
        az2_(std::exp(2.0 * azimuth_variance)),
        el1_(std::exp(0.5 * elevation_variance)),
        el2_(std::exp(2.0 * elevation_variance)) {}

  /// Unbiased for u.
  Eigen::Vector3d direction(const Angles& a) const {
    return {el1_ * az1_ * a.cos_el * a.sin_az, el1_ * az1_ * a.cos_el * a.cos_az, el1_ * a.sin_el};
  }

  /// Unbiased for u u'.
  Eigen::Matrix3d outerProduct(const Angles& a) const {
    const double cos_2el = el2_ * (1.0 - 2.0 * square(a.sin_el));
    const double cos_el_sq = 0.5 * (1.0 + cos_2el);
    const double sin_cos_el = el2_ * a.sin_el * a.cos_el;
    const double cos_2az = az2_ * (square(a.cos_az) - square(a.sin_az));
    const double xx = cos_el_sq * 0.5 * (1.0 - cos_2az);
    const double yy = cos_el_sq * 0.5 * (1.0 + cos_2az);
    const double xy = cos_el_sq * az2_ * a.sin_az * a.cos_az;
    const double xz = sin_cos_el * az1_ * a.sin_az;
    const double yz = sin_cos_el * az1_ * a.cos_az;
    Eigen::Matrix3d m;
    m << xx, xy, xz, xy, yy, yz, xz, yz, 0.5 * (1.0 - cos_2el);
    return m;
  }

 private:
  double az1_, az2_, el1_, el2_;
};

double degreesOfFreedom(std::size_t points) { return points > 3 ? static_cast<double>(points - 3) : 1.0; }

}  // namespace

double residualVariance(const RadarDirection& point, const Eigen::Vector3d& v_R,
                        const EgoVelocityOptions& options) {
  return quantizationVariance(options) + noiseVariance(Angles(point.u_R), v_R, options);
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
  const double variance = std::max(squares / degreesOfFreedom(points.size()), quantizationVariance(options));
  solution.covariance = variance * inverse;
  solution.solved = true;
  return solution;
}

// A measured direction u_m = u + e turns the residual d + u_m . v into Doppler noise plus e . v, and adds the
// covariance of e to u u' in H'H. The first is met by weights, the second by MomentCorrection. Estimating
// equation:
//   sum w_i ( U_i d_i + Q_i v ) = 0,   E[U_i] = u_i,  E[Q_i] = u_i u_i',  w_i = 1 / var_i,
// an unbiased score, so the estimate is consistent (Carroll et al., Measurement Error in Nonlinear Models,
// ch. 7; Fuller, Measurement Error Models, section 2.2). Three details matter:
// - Weights are taken at the direction corrected by its own residual. The measured direction correlates with
// its
//   residual, and weights that inherit this bias the estimate (by 0.3 % of the speed at 2.5 m/s); the
//   corrected one does not, to first order.
// - The noise given in the options is an upper bound. Its scale is estimated from the residuals (with the
// options
//   counting as kPriorPoints points), so that a better radar is not overcompensated.
// - Fuller's modification: the compensation is reduced by the share 1/n, without which the estimate has no
// moments.
VelocitySolution solveErrorsInVariables(const std::vector<RadarDirection>& points, const Eigen::Vector3d& v_R,
                                        const EgoVelocityOptions& options) {
  constexpr int kIterations = 3;
  constexpr double kPriorPoints = 10.0;

  VelocitySolution solution;
  const auto n = static_cast<double>(points.size());
  if (points.size() < 3) return solution;
  const double azimuth_variance = square(options.azimuth_sigma);
  const double elevation_variance = square(options.elevation_sigma);
  // Without any noise given the weights are equal; their size cancels.
  const double quantization_variance = std::max(quantizationVariance(options), 1e-12);

  Eigen::Vector3d v = v_R;
  double scale = 1.0;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const double fuller = 1.0 - 1.0 / n;
    const MomentCorrection correct(fuller * scale * azimuth_variance, fuller * scale * elevation_variance);
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Matrix3d score = Eigen::Matrix3d::Zero();  // covariance of the score
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    double excess = 0.0, promised = 0.0;
    for (const RadarDirection& p : points) {
      const Angles measured(p.u_R);
      const double residual = p.doppler + p.u_R.dot(v);
      const Eigen::Vector3d by_az = measured.byAzimuth();
      const Eigen::Vector3d by_el = measured.byElevation();
      const double measured_noise = noiseVariance(measured, v, options);
      const double shift = scale * residual / (quantization_variance + scale * measured_noise);
      const Angles corrected((p.u_R - shift * (azimuth_variance * by_az.dot(v) * by_az +
                                               elevation_variance * by_el.dot(v) * by_el))
                                 .normalized());
      const double noise = noiseVariance(corrected, v, options);
      const double weight = 1.0 / (quantization_variance + scale * noise);

      const Eigen::Vector3d u = correct.direction(measured);
      const Eigen::Matrix3d uu = correct.outerProduct(measured);
      const Eigen::Vector3d compensation = u * u.dot(v) - uu * v;
      normal += weight * uu;
      right -= weight * p.doppler * u;
      score += weight * u * u.transpose() + square(weight) * compensation * compensation.transpose();
      excess += square(residual) - quantization_variance;
      promised += noise;
    }
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
    eigen.computeDirect(normal);
    solution.solved = eigen.eigenvalues()[0] * options.max_condition_number > eigen.eigenvalues()[2];
    if (!solution.solved) return solution;
    const Eigen::Matrix3d inverse = eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() *
                                    eigen.eigenvectors().transpose();
    v = inverse * right;
    solution.covariance = inverse * score * inverse;

    if (promised > 0.0) {
      const double observed = std::max(0.0, excess * n / degreesOfFreedom(points.size()) / promised);
      scale = std::min(1.0, (kPriorPoints + n * observed) / (kPriorPoints + n));
    }
  }

  // Residuals larger than promised widen the covariance; smaller ones do not narrow it below the
  // quantisation.
  double chi2 = 0.0;
  for (const RadarDirection& p : points) {
    const double variance = quantization_variance + scale * noiseVariance(Angles(p.u_R), v, options);
    chi2 += square(p.doppler + p.u_R.dot(v)) / variance;
  }
  solution.covariance *= std::max(1.0, chi2 / degreesOfFreedom(points.size()));
  solution.v_R = v;
  return solution;
}

}  // namespace rio_t
