#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace rio_t {

/// A landmark as results show it.
struct LandmarkPoint {
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();  ///< [m]
  double sigma = 0.0;                             ///< [m] root of the trace of its covariance
  double snr_db = 0.0;                            ///< mean
  std::uint64_t id = 0;                           ///< counts up; never reused
  std::uint64_t sightings = 0;
};

/// The map's answer to a scan.
struct LandmarkAnswer {
  bool is_trusted = false;   ///< enough landmarks were seen again: the window uses the map
  bool dropped_map = false;  ///< map and estimate contradicted each other
  std::vector<LandmarkPoint> map;
};

}  // namespace rio_t
