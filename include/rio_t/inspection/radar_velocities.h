#pragma once

#include <Eigen/Core>
#include <vector>

#include "rio_t/inspection/inertial_track.h"
#include "rio_t/radar/doppler_grid.h"
#include "rio_t/radar/scan.h"

namespace rio_t {

/// The velocity that one scan, or a few neighbouring scans, show without the IMU.
struct RadarVelocity {
  Time stamp;
  Eigen::Vector3d v_R = Eigen::Vector3d::Zero();         ///< of the radar, in its own axes [m/s]
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< [m^2/s^2]
};

struct RadarVelocities {
  std::vector<RadarVelocity> velocities;  ///< in the order of the scans
  KnownDoppler doppler_step;
  bool has_elevation = true;
};

/// Computes velocities without a prior and without a filter by range, power or field of view. Combines scans
/// of few points, up to 20 points and 0.12 s. The velocity of a radar without elevation has no vertical part,
/// with a sigma of 1 m/s. `scans`: in the order of their stamps.
RadarVelocities radarVelocities(const std::vector<RadarScan>& scans);

/// The sign of the Doppler that the ranges show.
struct DopplerSign {
  /// +1: positive for receding targets; -1: for approaching ones; 0: the ranges do not show it.
  int sign = 0;
  double significance = 0.0;  ///< mean vote over its standard deviation; positive for receding
};

/// Compares the points of scans that lie 0.15 to 0.6 s apart: with the correct sign, a range changes as its
/// Doppler says. This needs neither the axes nor the mounting. Pairs between which the platform turns by more
/// than 7 degrees do not count. At 40 Hz or more, only every n-th scan is compared.
DopplerSign dopplerSignFromRanges(const std::vector<RadarScan>& scans, const InertialTrack& track);

/// The change of the ranges divided by the change that the Doppler says: 1 if the Doppler is in m/s.
struct RangeRatio {
  double ratio = 0.0;      ///< without a sign; 0: the ranges do not show it
  double log_sigma = 0.0;  ///< of its logarithm
};

/// Compares the points of the same pairs of scans, with any ratio from 1 / 200 to 200 and either sign. Takes
/// the ratio on which the most matches agree. Its sigma is that of a jackknife over parts of the recording.
RangeRatio rangeRatio(const std::vector<RadarScan>& scans, const InertialTrack& track);

}  // namespace rio_t
