#pragma once

#include <Eigen/Core>
#include <array>
#include <complex>
#include <vector>

#include "rio_t/radar/point_noise.h"

namespace rio_t {

/// Predicts the squared residuals r^2 of a scan from the variances of Doppler, azimuth and elevation.
///
/// The squares are summed with three weights, which tell the three variances apart: one, and the squares of
/// the derivatives of the radial speed by azimuth (over the cosine of the elevation) and by elevation. These
/// derivatives are known at the measured direction only, and its noise is also in r. The expected sums follow
/// from the measured directions alone, exactly for angles with normal noise (docs/method.md, 9.2).
class ResidualMoments {
 public:
  /// `v_R` [m/s] is the radar's velocity.
  explicit ResidualMoments(const Eigen::Vector3d& v_R);

  /// The weights of a point with the measured direction `u_R`.
  Eigen::Vector3d weights(const Eigen::Vector3d& u_R) const;
  /// Adds a point with the weight `share`.
  void add(const Eigen::Vector3d& u_R, double share);
  /// Row i times the variances is the expected sum of weight i times r^2. This sum is not linear in the
  /// variances of the angles, so the rows are exact at those of `noise`.
  Eigen::Matrix3d shares(const PointVariances& noise) const;

 private:
  /// c e^(i (azimuth a + elevation e)); a function of a direction is a sum of these.
  struct Harmonic {
    int azimuth, elevation;
    std::complex<double> c;
  };
  using Harmonics = std::vector<Harmonic>;
  static Harmonics product(const Harmonics& a, const Harmonics& b);
  std::complex<double> sumOf(int azimuth, int elevation) const;

  static constexpr int kOrder = 4;  // of a weight times r^2
  Eigen::Vector3d v_R_;
  Harmonics speed_;  // the radial one; the second half are the conjugates of the first
  std::array<Harmonics, 3> weights_;
  // Sums over the points of e^(i (p a + q e)), p from 0 to kOrder, q from -kOrder to kOrder.
  Eigen::Array<std::complex<double>, kOrder + 1, 2 * kOrder + 1, Eigen::RowMajor> sums_;
};

}  // namespace rio_t
