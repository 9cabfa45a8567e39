#include "rio_t/radar/point_noise.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "direction_noise.h"
#include "doppler_bin.h"

namespace rio_t {
namespace {

/// The noise at the start counts as so many points, whose residuals show nothing but that noise.
constexpr double kStartPoints = 10.0;
/// [scans] that PointNoise remembers, 100 s at 10 Hz. At a walk they show the elevation noise, which shows
/// least, to 3 %.
constexpr double kMemory = 1000.0;
/// [steps of the Doppler] At a lower speed most points lie in a few bins, and the error of the step is
/// neither even nor independent of the direction: at two steps it passes for three times the azimuth noise.
constexpr double kMinSpeed = 3.0;
/// [m/s] Residuals up to this size show how many outliers there are.
constexpr double kOutlierSpan = 1.0;
/// An angle or a Doppler with more noise is no measurement.
constexpr double kMaxAngleSigma = 0.2;    // [rad]
constexpr double kMaxDopplerSigma = 0.2;  // [m/s]
/// As kMinStartDopplerSigma.
constexpr double kMinStartAngleSigma = 0.01;  // [rad]
/// [m^2/s^2] Variance of a residual; it bounds the weights if there is no noise at all.
constexpr double kMinVariance = 1e-4;

/// Probability that a residual is of the static world and not of an outlier, spread evenly.
double inlierProbability(double residual, double variance, const PointVariances& noise) {
  const double density = dopplerDensity(residual, std::max(kMinVariance, variance), noise.quantization);
  return density / (density + noise.outlier_density);
}

/// Share of a new scan in what is known, after so many scans.
double forgotten(double scans) { return std::max(1.0 / kMemory, 1.0 / (scans + 1.0)); }

Eigen::Vector3d vectorOf(const PointVariances& noise) {
  return {noise.doppler, noise.azimuth, noise.elevation};
}

}  // namespace

PointNoise::PointNoise(const PointVariances& start) : start_(vectorOf(start)), variances_(start) {}

void PointNoise::learn(const std::vector<RadarDirection>& points, const std::vector<std::size_t>& inliers,
                       const Eigen::Vector3d& v_R) {
  learnOutliers(points, v_R);
  if (v_R.squaredNorm() >= square(kMinSpeed) * 12.0 * variances_.quantization)
    learnVariances(points, inliers, v_R);
}

void PointNoise::learnSpread(const std::vector<RadarDirection>& points) {
  if (points.empty()) return;
  constexpr double kKept = 1.0 - 1.0 / kMemory;
  azimuth_moments_.add(azimuthsOf(points), kKept);
  elevation_moments_.add(elevationsOf(points), kKept);
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
  within = kept * within + squares - sum * sum / n;
  freedom = kept * freedom + n - 1.0;
}

AngleSpread PointNoise::AngleMoments::spread() const {
  AngleSpread spread;
  spread.mean = all[1] / all[0];
  spread.variance = std::max(0.0, all[2] / all[0] - square(spread.mean));
  spread.within = freedom > 0.0 ? std::min(within / freedom, spread.variance) : spread.variance;
  return spread;
}

void PointNoise::learnOutliers(const std::vector<RadarDirection>& points, const Eigen::Vector3d& v_R) {
  double density = 0.0;
  for (const RadarDirection& p : points) {
    const double residual = p.doppler + p.u_R.dot(v_R);
    if (std::abs(residual) >= kOutlierSpan) continue;
    const Eigen::Vector3d shares =
        noiseShares(correctedDirection(p.u_R, residual, v_R, variances_), v_R, variances_);
    const double probability = inlierProbability(residual, shares.dot(vectorOf(variances_)), variances_);
    density += (1.0 - probability) / (2.0 * kOutlierSpan * static_cast<double>(points.size()));
  }
  ++scans_of_outliers_;
  double& believed = variances_.outlier_density;
  believed += forgotten(scans_of_outliers_) * (density - believed);
  believed = std::clamp(believed, kMinOutlierDensity, kMaxOutlierDensity);
}

void PointNoise::learnVariances(const std::vector<RadarDirection>& points,
                                const std::vector<std::size_t>& inliers, const Eigen::Vector3d& v_R) {
  const PointVariances& noise = variances_;
  const auto variance = [&](const Eigen::Vector3d& shares) {
    return std::max(kMinVariance, noise.quantization + shares.dot(vectorOf(noise)));
  };
  auto inlier = inliers.begin();
  const auto is_inlier = [&](const RadarDirection& p) {  // call it for one point after the other
    if (inlier == inliers.end() || *inlier != p.index) return false;
    ++inlier;
    return true;
  };

  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  for (const RadarDirection& p : points) {
    if (is_inlier(p)) normal += p.u_R * p.u_R.transpose() / variance(noiseShares(Angles(p.u_R), v_R, noise));
  }
  const Eigen::Matrix3d velocity_covariance = normal.inverse();

  ++scans_;
  const double share = forgotten(scans_);
  information_ *= 1.0 - share;
  information_vector_ *= 1.0 - share;
  Eigen::Vector3d mean_shares = Eigen::Vector3d::Zero();
  inlier = inliers.begin();
  for (const RadarDirection& p : points) {
    // The fit of the velocity has made the squared residuals of its inliers smaller by this.
    const double fitted = is_inlier(p) ? p.u_R.dot(velocity_covariance * p.u_R) : 0.0;
    const double residual = p.doppler + p.u_R.dot(v_R);
    const Eigen::Vector3d shares = noiseShares(correctedDirection(p.u_R, residual, v_R, noise), v_R, noise);
    // The variance of r^2 is twice the squared variance of r.
    const double probability = inlierProbability(residual, shares.dot(vectorOf(noise)), noise);
    const double weight = 0.5 * probability / square(variance(shares));
    mean_shares += shares / static_cast<double>(points.size());
    information_ += weight * shares * shares.transpose();
    information_vector_ += weight * (square(residual) + fitted - noise.quantization) * shares;
  }
  mean_shares_ += share * (mean_shares - mean_shares_);
  const double believed = variance(mean_shares_);
  solve();
  // The scans so far were weighted with the noise believed then. If it was much too small, they would
  // outweigh all scans to come.
  const double reweighting = square(believed / variance(mean_shares_));
  information_ *= reweighting;
  information_vector_ *= reweighting;
}

void PointNoise::solve() {
  constexpr int kSweeps = 20;  // the solution moves little from scan to scan, and each begins at the last
  const Eigen::Vector3d least =
      Eigen::Vector3d(kMinStartDopplerSigma, kMinStartAngleSigma, kMinStartAngleSigma).cwiseAbs2();
  const Eigen::Vector3d most =
      Eigen::Vector3d(kMaxDopplerSigma, kMaxAngleSigma, kMaxAngleSigma).cwiseAbs2().cwiseMax(start_);
  Eigen::Vector3d x = vectorOf(variances_);
  // A start that is too small must not count for more because of that.
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
