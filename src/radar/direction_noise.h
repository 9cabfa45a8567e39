#pragma once

#include <Eigen/Core>
#include <vector>

#include "rio_t/radar/direction.h"
#include "rio_t/radar/point_noise.h"
#include "rio_t/radar/scan.h"

namespace rio_t {

inline double square(double a) { return a * a; }

/// `angle`: azimuthOf or elevationOf.
inline std::vector<double> anglesOf(const std::vector<RadarDirection>& points,
                                    double (*angle)(const Eigen::Vector3d&)) {
  std::vector<double> angles;
  angles.reserve(points.size());
  for (const RadarDirection& p : points) angles.push_back(angle(p.u_R));
  return angles;
}

/// Azimuth and elevation of a unit vector, by their sines and cosines.
struct Angles {
  explicit Angles(const Eigen::Vector3d& u) : sin_el(u.z()), cos_el(u.head<2>().norm()) {
    // Straight up or down has no azimuth; any will do, since its derivatives vanish there.
    sin_az = cos_el > 1e-9 ? u.x() / cos_el : 0.0;
    cos_az = cos_el > 1e-9 ? u.y() / cos_el : 1.0;
  }
  Eigen::Vector3d byAzimuth() const { return {cos_az * cos_el, -sin_az * cos_el, 0.0}; }        // du/daz
  Eigen::Vector3d byElevation() const { return {-sin_el * sin_az, -sin_el * cos_az, cos_el}; }  // du/del
  Eigen::Vector3d direction() const { return {cos_el * sin_az, cos_el * cos_az, sin_el}; }
  double sin_el, cos_el, sin_az, cos_az;
};

/// Factors of the variances of Doppler, azimuth and elevation in the variance of a residual. The terms with
/// the radial speed come from second derivatives; the first ones vanish along the velocity.
inline Eigen::Vector3d noiseShares(const Angles& a, const Eigen::Vector3d& v_R, const PointVariances& noise) {
  const double radial = square(a.direction().dot(v_R));
  return {1.0, square(a.byAzimuth().dot(v_R)) + radial * (0.75 * noise.azimuth + 0.25 * noise.elevation),
          square(a.byElevation().dot(v_R)) + radial * (0.75 * noise.elevation + 0.25 * noise.azimuth)};
}

inline double residualVariance(const Angles& a, const Eigen::Vector3d& v_R, const PointVariances& noise) {
  return noise.quantization +
         noiseShares(a, v_R, noise).dot(Eigen::Vector3d(noise.doppler, noise.azimuth, noise.elevation));
}

/// The likeliest direction, given the measured one and its residual. Its error does not correlate with the
/// residual, to first order.
inline Angles correctedDirection(const Eigen::Vector3d& u_R, double residual, const Eigen::Vector3d& v_R,
                                 const PointVariances& noise) {
  const Angles measured(u_R);
  const Eigen::Vector3d by_az = measured.byAzimuth();
  const Eigen::Vector3d by_el = measured.byElevation();
  const double variance = residualVariance(measured, v_R, noise);
  if (!(variance > 0.0)) return measured;
  return Angles(
      (u_R - residual / variance *
                 (noise.azimuth * by_az.dot(v_R) * by_az + noise.elevation * by_el.dot(v_R) * by_el))
          .normalized());
}

}  // namespace rio_t
