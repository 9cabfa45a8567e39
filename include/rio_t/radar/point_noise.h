#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "rio_t/radar/scan.h"

namespace rio_t {

/// Noise of a point, independent from point to point.
struct PointVariances {
  double doppler = 0.0;       ///< [m^2/s^2] besides the quantisation
  double azimuth = 0.0;       ///< [rad^2]
  double elevation = 0.0;     ///< [rad^2]
  double quantization = 0.0;  ///< [m^2/s^2] of the Doppler: step^2 / 12
  /// [s/m] Density of Dopplers that are not of the static world, per point.
  double outlier_density = 0.01;
};

/// Learns the noise of the points from the Doppler residuals of scans in motion.
///
/// The variance of a residual is that of the Doppler plus those of the angles times their squared effect on
/// the Doppler. This effect differs from point to point, so a regression of the squared residuals gives all
/// three (docs/method.md, section 9). The start counts as a few points. If the motion does not show an angle,
/// its noise remains that of the start.
class PointNoise {
 public:
  explicit PointNoise(const PointVariances& start);

  /// Learns from a scan. `points` passed the filter; `inliers` are the indices of those that `v_R` was solved
  /// from. Both are in the order of the scan. `learn` also takes the other points, as far as they may belong
  /// to the static world: otherwise the known noise would cut off its own tails.
  void learn(const std::vector<RadarDirection>& points, const std::vector<std::size_t>& inliers,
             const Eigen::Vector3d& v_R);
  /// Sets the quantisation once it is known [m^2/s^2]. Earlier scans were learned with another one; they fade
  /// as all old scans do.
  void setQuantization(double variance) { variances_.quantization = variance; }
  /// The variances as learned so far; the quantisation is as it was given.
  const PointVariances& variances() const { return variances_; }

  /// [m/s] A smaller start counts as this one: the noise may turn out larger than a start of zero.
  static constexpr double kMinStartDopplerSigma = 0.01;

 private:
  void solve();

  // Vectors and matrices are of the variances of Doppler, azimuth and elevation.
  Eigen::Vector3d start_;  // read-only after construction
  PointVariances variances_;
  Eigen::Matrix3d information_ = Eigen::Matrix3d::Zero();         // of the scans
  Eigen::Vector3d information_vector_ = Eigen::Vector3d::Zero();  // that times the variances
  Eigen::Vector3d mean_shares_ = Eigen::Vector3d::Zero();         // of the variances in that of a residual
  double scans_ = 0.0;
};

}  // namespace rio_t
