#pragma once

#include <Eigen/Core>
#include <cmath>

#include "noise.h"
#include "rio_t/radar/ego_velocity.h"

namespace rio_t {

inline Eigen::Vector3d direction(double azimuth, double elevation) {
  return {std::cos(elevation) * std::sin(azimuth), std::cos(elevation) * std::cos(azimuth),
          std::sin(elevation)};
}

struct ScanNoise {
  double azimuth = 0.0, elevation = 0.0;     // [rad]
  double doppler = 0.0, quantization = 0.0;  // [m/s]
};

/// Static targets all over the field of view, seen at `v_R`.
inline RadarScan staticScene(const Eigen::Vector3d& v_R, int points, const ScanNoise& noise, Random& random,
                             double elevation_spread = 0.35) {
  RadarScan scan;
  for (int i = 0; i < points; ++i) {
    const double azimuth = random.uniform(-0.9, 0.9);
    const double elevation = random.uniform(-elevation_spread, elevation_spread);
    RadarPoint p;
    p.doppler = -direction(azimuth, elevation).dot(v_R) + noise.doppler * random.normal();
    if (noise.quantization > 0) p.doppler = noise.quantization * std::round(p.doppler / noise.quantization);
    p.position_R = random.uniform(1.0, 9.0) * direction(azimuth + noise.azimuth * random.normal(),
                                                        elevation + noise.elevation * random.normal());
    p.snr_db = 15.0;
    scan.points.push_back(p);
  }
  return scan;
}

/// The defaults, for a radar whose step is known.
inline EgoVelocityOptions knownStep(double step = 0.125) {
  EgoVelocityOptions o;
  o.doppler_quantization = step;
  return o;
}

/// Estimation without anything that widens the covariance, for tests of the solver.
inline EgoVelocityOptions bareOptions(EgoVelocitySolver solver) {
  EgoVelocityOptions o = knownStep();
  o.solver = solver;
  o.added_sigma.setZero();
  return o;
}

/// [m/s] Given as the step: the Doppler has none.
constexpr double kNoStep = 1e-6;

inline const Eigen::Vector3d kVelocity(0.4, 1.2, -0.3);

/// 2.5 and 4.5 degrees.
inline EgoVelocityOptions simulatedRadarOptions() {
  EgoVelocityOptions o = knownStep();
  o.azimuth_sigma = 0.0436;
  o.elevation_sigma = 0.0785;
  o.doppler_sigma = 0.02;
  return o;
}

}  // namespace rio_t
