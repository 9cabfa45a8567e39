#include "rio_t/radar/doppler_likelihood.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "angle_regression.h"
#include "direction_noise.h"
#include "doppler_bin.h"

namespace rio_t {
namespace {

/// [sigma] A smaller residual is as good as zero; its derivative is that at zero.
constexpr double kNoResidual = 1e-4;
/// A pivot below this share of the trace is rounding.
constexpr double kNoInformation = 1e-12;
constexpr double kSurely = 2.0;   // [sigma]
constexpr double kSpreads = 4.0;  // [variances] of the noise

double density(double z) { return std::exp(-0.5 * z * z) * (0.5 * M_SQRT1_2 * M_2_SQRTPI); }

/// A residual r and its derivative by the error.
struct Residual {
  double value, slope;
};

/// Noise larger than the bin: r^2 / 2 = -log((exp(-z^2 / 2) + outlier) / (1 + outlier)), where z is the error
/// in sigmas. The derivative is by z, too.
Residual fineResidual(double z, double outlier) {
  const double inlier = std::exp(-0.5 * z * z);
  const double probability = inlier / (inlier + outlier);
  const double half_square = -std::log((inlier + outlier) / (1.0 + outlier));
  const double value = std::sqrt(2.0 * std::max(0.0, half_square));
  if (value < kNoResidual) return {std::sqrt(probability) * z, std::sqrt(probability)};
  return {std::copysign(value, z), probability * std::abs(z) / value};
}

/// The same for a bin that reaches `half` to either side of the Doppler: exp(-z^2 / 2) becomes the
/// probability of the bin. `centre` is the probability of the bin around z = 0.
Residual coarseResidual(double z, double half, double centre, double outlier) {
  const double floor = outlier * centre;
  const double bin = binProbability(z, half);
  const double half_square = -std::log((bin + floor) / (centre + floor));
  const double value = std::sqrt(2.0 * std::max(0.0, half_square));
  if (value < kNoResidual) {  // r = z sqrt(-bin'' / bin) around zero
    const double root = std::sqrt(2.0 * half * density(half) / (centre + floor));
    return {root * z, root};
  }
  const double size = std::abs(z);
  return {std::copysign(value, z), (density(size - half) - density(size + half)) / ((bin + floor) * value)};
}

/// Whether the measured `angles` of a scan surely spread much more than by their noise. `noise` is its
/// variance. The variance of n samples has a relative standard deviation of sqrt(2 / n).
bool showsSpread(const std::vector<double>& angles, double noise) {
  const auto n = static_cast<double>(angles.size());
  const double mean = std::accumulate(angles.begin(), angles.end(), 0.0) / n;
  double squares = 0.0;
  for (const double angle : angles) squares += square(angle - mean);
  return squares / n * (1.0 - kSurely * std::sqrt(2.0 / n)) > kSpreads * noise;
}

/// The expected true directions, given the measured angles but not the Dopplers.
struct ExpectedDirections {
  PointVariances shown;                 ///< noise that `u_R` still has
  std::vector<Eigen::Vector3d> u_R;     ///< expected
  std::vector<Eigen::Vector3d> mean_R;  ///< mean of the true directions; its length is not 1
  std::vector<double> variances;        ///< of the residuals, without `shown` [m^2/s^2]
};

// The noise of an angle is in both the direction and the residual, which biases the velocity. Corrections:
// - Many points show their spread by themselves. Then the sigma of a residual grows with the velocity, and
//   its derivative corrects the bias (`shown`: errors in variables).
// - Few points do not. Then the expected angle is nearer to the mean than the measured one, by regression on
//   earlier scans. Its error (`left`) does not correlate with the expected direction.
ExpectedDirections expectedDirections(const std::vector<RadarDirection>& points, const Eigen::Vector3d& v_R,
                                      const PointVariances& noise) {
  const std::vector<double> azimuths = anglesOf(points, azimuthOf);
  const std::vector<double> elevations = anglesOf(points, elevationOf);
  const AngleRegression by_azimuth(azimuths, noise.azimuth, noise.azimuths);
  const AngleRegression by_elevation(elevations, noise.elevation, noise.elevations);
  const bool shows_azimuth = showsSpread(azimuths, noise.azimuth);
  const bool shows_elevation = showsSpread(elevations, noise.elevation);
  ExpectedDirections result;
  result.shown = noise;
  PointVariances left;
  left.doppler = noise.doppler + kMinDopplerVariance;
  (shows_azimuth ? left : result.shown).azimuth = 0.0;
  (shows_elevation ? left : result.shown).elevation = 0.0;
  if (!shows_azimuth) left.azimuth = by_azimuth.remaining();
  if (!shows_elevation) left.elevation = by_elevation.remaining();

  // The mean direction of a noisy one is shorter than the true one: E[cos(a + e)] = exp(-s^2 / 2) cos(a).
  const double longer_el = std::exp(0.5 * result.shown.elevation);
  const double longer_az = longer_el * std::exp(0.5 * result.shown.azimuth);
  result.u_R.reserve(points.size());
  result.mean_R.reserve(points.size());
  result.variances.reserve(points.size());
  double mean_variance = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    double azimuth = azimuths[i], elevation = elevations[i];
    Eigen::Vector3d length(longer_az, longer_az, longer_el);
    if (!shows_azimuth) {
      length.head<2>() *= by_azimuth.shortening(azimuth);
      azimuth = by_azimuth.expected(azimuth);
    }
    if (!shows_elevation) {
      length *= by_elevation.shortening(elevation);
      elevation = by_elevation.expected(elevation);
    }
    const bool is_measured = shows_azimuth && shows_elevation;
    result.u_R.push_back(is_measured ? points[i].u_R : directionOf(azimuth, elevation));
    result.mean_R.emplace_back(length.cwiseProduct(result.u_R.back()));
    result.variances.push_back(residualVariance(Angles(result.u_R.back()), v_R, left));
    mean_variance += result.variances.back() / static_cast<double>(points.size());
  }
  // Without wide bins this is least squares, and all points get the same variance: the regression is right
  // over all points, but not at each angle, so the weights must not depend on the angle. Bins wider than the
  // noise bound the velocity by their edges, which are as sharp as the noise of each point.
  if (3.0 * noise.quantization <= mean_variance) result.variances.assign(points.size(), mean_variance);
  return result;
}

}  // namespace

VelocityCost withSharedError(const VelocityCost& cost, const Eigen::Vector3d& variances,
                             Eigen::Vector3d* error) {
  // The minimum over e of cost(v + e) + e' D^-1 e / 2, with cost as a quadratic; D may be zero.
  const Eigen::Vector3d sigmas = variances.cwiseSqrt();
  const Eigen::Matrix3d& H = cost.information;
  const Eigen::Matrix3d inner = Eigen::Matrix3d::Identity() + sigmas.asDiagonal() * H * sigmas.asDiagonal();
  const Eigen::Matrix3d K = sigmas.asDiagonal() * inner.inverse() * sigmas.asDiagonal();
  const Eigen::Vector3d e = -K * cost.gradient;
  if (error != nullptr) *error = e;
  const Eigen::Matrix3d HK = H * K;
  return {cost.value + 0.5 * cost.gradient.dot(e), cost.gradient + H * e, H - HK * H};
}

Eigen::Matrix3d semidefiniteRoot(const Eigen::Matrix3d& A) {
  const double least = kNoInformation * A.trace();
  Eigen::Matrix3d U = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 3; ++i) {
    const double pivot = A(i, i) - U.col(i).head(i).squaredNorm();
    if (!(pivot > least)) continue;
    U(i, i) = std::sqrt(pivot);
    for (int j = i + 1; j < 3; ++j) U(i, j) = (A(i, j) - U.col(i).head(i).dot(U.col(j).head(i))) / U(i, i);
  }
  return U;
}

Eigen::Vector3d solveTransposed(const Eigen::Matrix3d& U, const Eigen::Vector3d& b) {
  Eigen::Vector3d x = Eigen::Vector3d::Zero();
  for (int i = 0; i < 3; ++i)
    if (U(i, i) > 0.0) x[i] = (b[i] - U.col(i).head(i).dot(x.head(i))) / U(i, i);
  return x;
}

DopplerLikelihood::DopplerLikelihood(const std::vector<RadarDirection>& points, const Eigen::Vector3d& v_R,
                                     const PointVariances& noise)
    : about_(v_R),
      half_bin_(std::sqrt(3.0 * noise.quantization)),
      smallest_sigma_(std::numeric_limits<double>::max()) {
  ExpectedDirections expected = expectedDirections(points, v_R, noise);
  PointVariances& shown = expected.shown;
  const double along_az = 0.75 * shown.azimuth + 0.25 * shown.elevation;
  const double along_el = 0.75 * shown.elevation + 0.25 * shown.azimuth;
  points_.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    shown.doppler = expected.variances[i];
    // The spread is that at the direction corrected by the residual. At the measured direction it would
    // correlate with the residual.
    const double residual = points[i].doppler + expected.u_R[i].dot(v_R);
    const Angles a = correctedDirection(expected.u_R[i], residual, v_R, shown);
    const Eigen::Vector3d u = a.direction();
    const Eigen::Matrix3d spread =
        shown.azimuth * a.byAzimuth() * a.byAzimuth().transpose() +
        shown.elevation * a.byElevation() * a.byElevation().transpose() +
        (shown.azimuth * along_az + shown.elevation * along_el) * u * u.transpose();
    const double variance = expected.variances[i] + v_R.dot(spread * v_R);
    const double sigma = std::sqrt(variance);
    smallest_sigma_ = std::min(smallest_sigma_, sigma);
    const double whole = std::sqrt(variance + noise.quantization);
    Point& point = points_.emplace_back();
    point.u_R = expected.mean_R[i];
    point.doppler = points[i].doppler;
    point.spread = spread;
    point.fixed_variance = expected.variances[i] + noise.quantization;
    point.outlier = noise.outlier_density * std::sqrt(2.0 * M_PI) * whole;
    if (half_bin_ <= sigma) continue;
    point.half_bin = half_bin_ / sigma;
    point.whole_sigma = whole / sigma;
    point.centre = std::erf(point.half_bin * M_SQRT1_2);
  }
}

double DopplerLikelihood::residual(std::size_t i, const Eigen::Vector3d& v_R,
                                   Eigen::Vector3d& derivative) const {
  const Point& p = points_[i];
  const double e = p.doppler + p.u_R.dot(v_R);
  const Eigen::Vector3d spread_v = p.spread * v_R;
  const double inverse = 1.0 / (p.fixed_variance + v_R.dot(spread_v));
  const double scale = p.whole_sigma * std::sqrt(inverse);
  const Residual r = p.half_bin > 0.0 ? coarseResidual(scale * e, p.half_bin, p.centre, p.outlier)
                                      : fineResidual(scale * e, p.outlier);
  derivative = r.slope * scale * (p.u_R - (inverse * e) * spread_v);
  return r.value;
}

// The error of rounding has the variance q^2/12, and all points that read one bin share it. Within a bin of
// half width h, the likelihood is flat except for the share s/h near the edges, which J'J has.
Eigen::Matrix3d DopplerLikelihood::binInformation() const {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  if (!(half_bin_ > smallest_sigma_)) return information;
  std::vector<long> bins;  // by point
  bins.reserve(points_.size());
  for (const Point& p : points_) bins.push_back(std::lround(p.doppler / (2.0 * half_bin_)));
  std::vector<long> sorted = bins;
  std::sort(sorted.begin(), sorted.end());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Point& p = points_[i];
    if (p.half_bin == 0.0) continue;
    const double flat = 1.0 - 1.0 / p.half_bin;
    const double variance = square(p.whole_sigma * half_bin_ / p.half_bin);
    const auto [first, last] = std::equal_range(sorted.begin(), sorted.end(), bins[i]);
    information += flat / (static_cast<double>(last - first) * variance) * p.u_R * p.u_R.transpose();
  }
  return information;
}

VelocityCost DopplerLikelihood::at(const Eigen::Vector3d& v_R) const {
  VelocityCost cost;
  Eigen::Vector3d J;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const double r = residual(i, v_R, J);
    cost.value += 0.5 * r * r;
    cost.gradient += r * J;
    cost.information += J * J.transpose();
  }
  return cost;
}

}  // namespace rio_t
