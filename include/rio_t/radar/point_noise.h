#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "rio_t/radar/scan.h"
#include "rio_t/radar/velocity_prior.h"

namespace rio_t {

class DopplerLikelihood;

/// [s/m] Bounds of the density of the outliers, per point: 1 point in 200, and every other point, over 5 m/s.
/// With a larger density, points would count as outliers long after their noise has grown.
constexpr double kMinOutlierDensity = 0.001;
constexpr double kMaxOutlierDensity = 0.1;

/// How an angle of the reported points is distributed, its noise included [rad^2]. Infinite: not known.
struct AngleSpread {
  double mean = 0.0;                                          ///< of all points [rad]
  double variance = std::numeric_limits<double>::infinity();  ///< about it
  double within = std::numeric_limits<double>::infinity();    ///< about the mean of their scan
  double skewness = 0.0;                                      ///< likewise, the mean cube over within^(3/2)
  /// Degrees of freedom with which earlier scans predict the variance of one scan: few if the scans differ.
  double within_freedom = std::numeric_limits<double>::infinity();
};

/// Noise of a point, independent from point to point, with the density of outliers and the spread of angles.
struct PointVariances {
  double doppler = 0.0;       ///< [m^2/s^2] besides the quantisation
  double azimuth = 0.0;       ///< [rad^2]
  double elevation = 0.0;     ///< [rad^2]
  double quantization = 0.0;  ///< [m^2/s^2] of the Doppler: step^2 / 12
  /// [s/m] Density of Dopplers that are not of the static world, per point. It begins with the largest, so
  /// that few points do not claim much before scans have shown the density.
  double outlier_density = kMaxOutlierDensity;
  AngleSpread azimuths, elevations;
};

/// Learns the noise of the points from the Doppler residuals of scans in motion.
///
/// The variance of a residual is that of the Doppler plus those of the angles times their squared effect on
/// the Doppler. This effect differs from point to point, so the likelihood of the Dopplers within their bins
/// gives all three (docs/method.md, section 9). The start counts as a few points. If the motion does not show
/// an angle, its noise remains that of the start. How the angles spread is learned from every scan.
class PointNoise {
 public:
  explicit PointNoise(const PointVariances& start);

  /// Learns from a scan. `points` passed the filter; `world` is the likelihood of those that look static.
  /// `learn` weighs every point by the probability that it is static. The inliers alone would cut off the
  /// tails of the noise. `prior`, if any, is independent of this scan.
  void learn(const std::vector<RadarDirection>& points, const DopplerLikelihood& world,
             const std::optional<VelocityPrior>& prior);
  /// Learns how far the directions of a scan spread, moving or not. `points` passed the filter.
  void learnSpread(const std::vector<RadarDirection>& points);
  /// Sets the quantisation once it is known [m^2/s^2]. Earlier scans were learned with another one; they fade
  /// as all old scans do.
  void setQuantization(double variance) { variances_.quantization = variance; }
  /// The variances as learned so far; the quantisation is as it was given.
  const PointVariances& variances() const { return variances_; }

  /// [m/s] A smaller start counts as this one: the noise may turn out larger than a start of zero.
  static constexpr double kMinStartDopplerSigma = 0.01;

 private:
  void solve();
  /// Information of a point about the variance of its residual, given the shares of the variances in it.
  double informationAbout(const Eigen::Vector3d& shares) const;

  /// Sums over the points of earlier scans.
  struct AngleMoments {
    Eigen::Vector3d all = Eigen::Vector3d::Zero();  // of the powers 0, 1 and 2
    double within = 0.0;                            // squares about the mean of the scan
    double freedom = 0.0;                           // of these squares
    double cubes = 0.0, cube_freedom = 0.0;         // likewise
    // Over the last scans: squares of the logarithms of their variances over `within`, those that chance
    // gives, and their number.
    Eigen::Vector3d scatter = Eigen::Vector3d::Zero();
    void add(const std::vector<double>& angles, double kept);
    AngleSpread spread() const;
  };

  // Vectors and matrices are of the variances of Doppler, azimuth and elevation.
  Eigen::Vector3d start_;  // read-only after construction
  PointVariances variances_;
  Eigen::Matrix3d information_ = Eigen::Matrix3d::Zero();         // of the scans
  Eigen::Vector3d information_vector_ = Eigen::Vector3d::Zero();  // that times the variances
  Eigen::Vector3d mean_shares_ = Eigen::Vector3d::Zero();         // of the variances in that of a residual
  double mean_squared_speed_ = 0.0;                               // [m^2/s^2]
  AngleMoments azimuth_moments_, elevation_moments_;
  double scans_ = 0.0;
};

}  // namespace rio_t
