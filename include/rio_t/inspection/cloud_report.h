#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "rio_t/radar/scan.h"

namespace rio_t {

struct CloudReport {
  std::size_t points = 0;
  double points_10 = 0.0, points_50 = 0.0,
         points_90 = 0.0;                       ///< points of a scan: 10, 50 and 90 % of the scans have fewer
  double empty = 0.0;                           ///< share of the scans without a point
  double range_99 = 0.0;                        ///< [m]
  double azimuth_95 = 0.0, elevation_95 = 0.0;  ///< [rad] 95 % of the points are within this of forward (y)
  double behind = 0.0;                          ///< share of the points with a negative y
  double ambiguous = 0.0;                       ///< share of the points that markAmbiguous() marks
  Eigen::Vector3d mean_direction = Eigen::Vector3d::Zero();  ///< of unit vectors; short: it looks all around
  Eigen::Vector3d spread = Eigen::Vector3d::Zero();  ///< standard deviation of the unit vectors, per axis
  bool has_doppler = false;                          ///< some Doppler is not zero
};

CloudReport inspectCloud(const std::vector<RadarScan>& scans);

}  // namespace rio_t
