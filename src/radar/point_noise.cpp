#include "rio_t/radar/point_noise.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "direction_noise.h"
#include "doppler_bin.h"
#include "residual_moments.h"
#include "velocity_solver.h"

namespace rio_t {
namespace {

/// The noise at the start counts as n points, whose residuals show nothing but that noise.
constexpr double kStartPoints = 10.0;
/// [scans] that PointNoise remembers, 100 s at 10 Hz. At a walk they show the noise of the elevation, the
/// least observable one, to 3 %.
constexpr double kMemory = 1000.0;
/// [scans] over which changes of the spread of the directions show: a platform turns within seconds.
constexpr double kViewMemory = 100.0;
/// A scan of fewer points hardly shows how far its directions spread.
constexpr double kFewPoints = 5.0;
/// [m/s] Residuals up to this size show how many outliers there are.
constexpr double kOutlierSpan = 1.0;
/// An angle or a Doppler with more noise is no measurement.
constexpr double kMaxAngleSigma = 0.2;    // [rad]
constexpr double kMaxDopplerSigma = 0.2;  // [m/s]
/// As kMinStartDopplerSigma.
constexpr double kMinStartAngleSigma = 0.01;  // [rad]
/// [m^2/s^2] Variance of a residual; it bounds the weights if there is no noise at all.
constexpr double kMinVariance = 1e-4;

/// Weight of a new scan among all, after n scans.
double weightOfNewScan(double scans) { return std::max(1.0 / kMemory, 1.0 / (scans + 1.0)); }

/// Variance of the logarithm of a variance that has n degrees of freedom: trigamma of half of them.
double varianceOfLogarithm(double freedom) {
  const double x = 0.5 * freedom;
  const double y = x + 1.0;
  return 1.0 / (x * x) + 1.0 / y + 0.5 / (y * y) + 1.0 / (6.0 * y * y * y);
}

Eigen::Vector3d vectorOf(const PointVariances& noise) {
  return {noise.doppler, noise.azimuth, noise.elevation};
}

}  // namespace

PointNoise::PointNoise(const PointVariances& start) : start_(vectorOf(start)), variances_(start) {}

void PointNoise::learnSpread(const std::vector<RadarDirection>& points) {
  if (points.empty()) return;
  constexpr double kKept = 1.0 - 1.0 / kMemory;
  azimuth_moments_.add(anglesOf(points, azimuthOf), kKept);
  elevation_moments_.add(anglesOf(points, elevationOf), kKept);
  variances_.azimuths = azimuth_moments_.spread();
  variances_.elevations = elevation_moments_.spread();
}

void PointNoise::AngleMoments::add(const std::vector<double>& angles, double kept) {
  const auto n = static_cast<double>(angles.size());
  double sum = 0.0, squares = 0.0;
  for (const double angle : angles) {
    sum += angle;
    squares += square(angle);
  }
  all = kept * all + Eigen::Vector3d(n, sum, squares);
  const double own = squares - sum * sum / n;
  within = kept * within + own;
  freedom = kept * freedom + n - 1.0;
  cubes *= kept;
  for (const double angle : angles) {
    const double away = angle - sum / n;
    cubes += away * away * away;
  }
  cube_freedom = kept * cube_freedom + (n - 1.0) * (n - 2.0) / n;
  if (n < kFewPoints || own <= 0.0) return;
  const double logarithm = std::log(own / (n - 1.0) / (within / freedom));
  scatter = (1.0 - 1.0 / kViewMemory) * scatter +
            Eigen::Vector3d(square(logarithm), varianceOfLogarithm(n - 1.0), 1.0);
}

AngleSpread PointNoise::AngleMoments::spread() const {
  AngleSpread spread;
  spread.mean = all[1] / all[0];
  spread.variance = std::max(0.0, all[2] / all[0] - square(spread.mean));
  spread.within = freedom > 0.0 ? std::min(within / freedom, spread.variance) : spread.variance;
  if (cube_freedom > 0.0 && spread.within > 0.0)
    spread.skewness = cubes / cube_freedom / std::pow(spread.within, 1.5);
  const double excess = scatter[2] > 0.0 ? (scatter[0] - scatter[1]) / scatter[2] : 0.0;
  if (excess > 0.0) spread.within_freedom = (1.0 + std::sqrt(1.0 + 2.0 * excess)) / excess;
  return spread;
}

void PointNoise::learn(const std::vector<RadarDirection>& points, const DopplerLikelihood& world,
                       const std::optional<VelocityPrior>& prior) {
  const LikeliestVelocity velocity = findLikeliest(world, prior, world.about());
  const Eigen::Matrix3d covariance = velocity.information.inverse();

  ++scans_;
  const double share = weightOfNewScan(scans_);
  information_ *= 1.0 - share;
  information_vector_ *= 1.0 - share;
  const auto count = static_cast<double>(points.size());
  Eigen::Vector3d mean_shares = Eigen::Vector3d::Zero();
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  double outlier_density = 0.0;
  ResidualMoments moments(velocity.v_R);
  for (const RadarDirection& p : points) {
    const double residual = p.doppler + p.u_R.dot(velocity.v_R);
    const Eigen::Vector3d shares = noiseShares(Angles(p.u_R), velocity.v_R, variances_);
    const double variance = std::max(kMinVariance, shares.dot(vectorOf(variances_)));
    const auto densityAt = [&](double e) { return dopplerDensity(e, variance, variances_.quantization); };
    // Derivative of the log of the likelihood, that of an outlier included, by the variance.
    const auto slopeOf = [&](const DopplerDensity& d) {
      return d.by_variance / (d.value + variances_.outlier_density);
    };
    const DopplerDensity density = densityAt(residual);
    const double probability = density.value / (density.value + variances_.outlier_density);
    // The fit absorbs some of the noise. So the slope is averaged over the uncertainty of the velocity, by a
    // quadrature with three points.
    const double open = std::sqrt(std::max(0.0, 3.0 * p.u_R.dot(covariance * p.u_R)));
    const double slope =
        (slopeOf(densityAt(residual - open)) + 4.0 * slopeOf(density) + slopeOf(densityAt(residual + open))) /
        6.0;
    const double excess = slope / varianceInformation(variance, variances_.quantization);
    moments.add(p.u_R, probability);
    squares += (excess + probability * variance) * moments.weights(p.u_R);
    mean_shares += shares / count;
    if (std::abs(residual) < kOutlierSpan)
      outlier_density += (1.0 - probability) / (2.0 * kOutlierSpan * count);
  }
  double& believed_density = variances_.outlier_density;
  believed_density += share * (outlier_density - believed_density);
  believed_density = std::clamp(believed_density, kMinOutlierDensity, kMaxOutlierDensity);

  const double squared_speed = velocity.v_R.squaredNorm();
  mean_shares_ += share * (mean_shares - mean_shares_);
  mean_squared_speed_ += share * (squared_speed - mean_squared_speed_);
  // All points of a scan count alike. A weight that differs with the direction would depend on its noise.
  const double faster = mean_squared_speed_ > 0.0 ? squared_speed / mean_squared_speed_ : 1.0;
  const double weight = informationAbout({1.0, faster * mean_shares_[1], faster * mean_shares_[2]});
  // The noise of an angle is at most its spread.
  PointVariances possible = variances_;
  possible.azimuth = std::min(possible.azimuth, possible.azimuths.variance);
  possible.elevation = std::min(possible.elevation, possible.elevations.variance);
  information_ += weight * moments.shares(possible);
  information_vector_ += weight * squares;
  const double believed = informationAbout(mean_shares_);
  solve();
  // The scans so far were weighted with the noise believed then. If it was much too small, they would
  // outweigh all scans to come.
  const double reweighting = informationAbout(mean_shares_) / believed;
  information_ *= reweighting;
  information_vector_ *= reweighting;
}

double PointNoise::informationAbout(const Eigen::Vector3d& shares) const {
  const double variance = shares.dot(vectorOf(variances_));
  return varianceInformation(std::max(kMinVariance, variance), variances_.quantization);
}

void PointNoise::solve() {
  constexpr int kSweeps = 20;  // the solution moves little from scan to scan, and each begins at the last
  const Eigen::Vector3d least =
      Eigen::Vector3d(kMinStartDopplerSigma, kMinStartAngleSigma, kMinStartAngleSigma).cwiseAbs2();
  const Eigen::Vector3d most =
      Eigen::Vector3d(kMaxDopplerSigma, kMaxAngleSigma, kMaxAngleSigma).cwiseAbs2().cwiseMax(start_);
  Eigen::Vector3d x = vectorOf(variances_);
  // A start that is too small must not get a larger weight because of that.
  const Eigen::Vector3d start_information =
      0.5 * kStartPoints * x.cwiseMax(start_).cwiseMax(least).cwiseAbs2().cwiseInverse();
  Eigen::Matrix3d A = information_;
  A.diagonal() += start_information;
  const Eigen::Vector3d b = information_vector_ + start_information.cwiseProduct(start_);
  // Least squares within bounds, one unknown after the other.
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (int i = 0; i < 3; ++i) x[i] = std::clamp(x[i] + (b[i] - A.row(i).dot(x)) / A(i, i), 0.0, most[i]);
  }
  variances_.doppler = x[0];
  variances_.azimuth = x[1];
  variances_.elevation = x[2];
}

}  // namespace rio_t
