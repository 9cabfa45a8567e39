#pragma once

#include <Eigen/Core>
#include <vector>

#include "rio_t/radar/point_noise.h"
#include "rio_t/radar/scan.h"

namespace rio_t {

/// Half a sum of squares, and its derivatives with respect to a velocity.
struct VelocityCost {
  double value = 0.0;
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  ///< J'J; may be singular
};

/// The minimum of the cost over an error of the velocity that all points share. `variances` [m^2/s^2] are
/// those of the error along its axes. `error` receives the error at the minimum [m/s], if given.
VelocityCost withSharedError(const VelocityCost& cost, const Eigen::Vector3d& variances,
                             Eigen::Vector3d* error = nullptr);

/// Factor of a positive semidefinite matrix, A = U'U with U upper triangular. A direction without information
/// gives a row of zeros.
Eigen::Matrix3d semidefiniteRoot(const Eigen::Matrix3d& A);
/// U'^-1 b, where b is in the range of U'. Zero in the rows of zeros.
Eigen::Vector3d solveTransposed(const Eigen::Matrix3d& U, const Eigen::Vector3d& b);

/// Likelihood of the Dopplers of a scan, given the radar's velocity (docs/method.md, section 5.7).
///
/// Each point gives one residual. The residual compares the Doppler that the radar measured with the one that
/// a static point would show. Half the sum of the squared residuals is minus the logarithm of the likelihood,
/// so least squares can use it. The model: a Doppler is right within its bin and its noise; or, with a small
/// probability, the point is an outlier, and its Doppler can be anything.
/// - Bin: a bin wider than the noise bounds the velocity along the ray and does not pull it to the centre.
/// - Noise of the direction: it widens the sigma of a residual, and it shortens the velocity of plain least
///   squares. With many points, the derivative of that sigma corrects the velocity (total least squares).
///   With few points, the direction is taken between the measured one and the mean of earlier scans
///   (regression calibration).
/// - Outliers: the residual is bounded, so that an outlier has no weight (a redescending loss).
class DopplerLikelihood {
 public:
  /// `points` look static at about the velocity `v_R` [m/s].
  DopplerLikelihood(const std::vector<RadarDirection>& points, const Eigen::Vector3d& v_R,
                    const PointVariances& noise);

  VelocityCost at(const Eigen::Vector3d& v_R) const;
  /// Information of the bins that are wider than the noise [s^2/m^2]. J'J lacks it: a point far within its
  /// bin has no derivative, and yet the bin bounds the velocity.
  Eigen::Matrix3d binInformation() const;
  /// Residual of point i, and its derivative. For tests; `at` adds these up.
  double residual(std::size_t i, const Eigen::Vector3d& v_R, Eigen::Vector3d& derivative) const;
  std::size_t size() const { return points_.size(); }
  double smallestSigma() const { return smallest_sigma_; }  ///< of a point, without the bin [m/s]
  double halfBin() const { return half_bin_; }              ///< [m/s]
  const Eigen::Vector3d& about() const { return about_; }   ///< `v_R` of the constructor [m/s]

 private:
  struct Point {
    Eigen::Vector3d u_R = Eigen::Vector3d::Zero();
    double doppler = 0.0;
    Eigen::Matrix3d spread;       ///< v' spread v: part of the residual's variance that grows with v
    double fixed_variance = 0.0;  ///< [m^2/s^2] the rest of the variance, with the bin
    double outlier = 0.0;         ///< density of outliers over the largest density of a static point
    // The next three describe a bin that is wider than the noise. Their unit is the sigma of the noise at the
    // first velocity, but for `centre`.
    double half_bin = 0.0;     ///< half its width; 0 if the noise is wider
    double whole_sigma = 1.0;  ///< of noise and bin together
    double centre = 0.0;       ///< probability of the bin around no error
  };

  std::vector<Point> points_;
  Eigen::Vector3d about_;
  double half_bin_;  ///< [m/s]
  double smallest_sigma_;
};

}  // namespace rio_t
