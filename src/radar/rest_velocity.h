#pragma once

#include <optional>
#include <vector>

#include "rio_t/radar/ego_velocity.h"
#include "velocity_solver.h"

namespace rio_t {

/// Whether enough points read zero for a platform at rest: `zero_velocity_outlier_fraction` may read more.
bool mostReadZero(const std::vector<RadarDirection>& points, const EgoVelocityOptions& options);

/// The points that read zero.
std::vector<RadarDirection> selectZeros(const std::vector<RadarDirection>& points,
                                        const EgoVelocityOptions& options);

/// The points that read zero or the bin beside it.
std::vector<RadarDirection> selectSlow(const std::vector<RadarDirection>& points,
                                       const EgoVelocityOptions& options);

/// Zero velocity and its covariance. All `inliers` read the zero bin.
VelocitySolution solveRest(const std::vector<RadarDirection>& inliers, const PointVariances& noise,
                           const EgoVelocityOptions& options);

/// Whether the points that do not read zero show one motion in all directions. `points` are of many scans. An
/// echo that moves by itself, as a curtain does, reads the same in all of them, so each direction counts
/// once: F test of the motion against what the directions differ otherwise.
bool directionsAgreeOnMotion(const std::vector<RadarDirection>& points, const EgoVelocityOptions& options);

struct SlowVelocity {
  VelocitySolution solution;
  std::vector<RadarDirection> inliers;  ///< the points that agree with the solution
};

/// A slow motion that hides in the bins around zero: most points read zero, but those along the motion do
/// not. None if rest explains the points about as well, or if most points read more than one bin.
std::optional<SlowVelocity> findSlowVelocity(const std::vector<RadarDirection>& points,
                                             const PointVariances& noise, const EgoVelocityOptions& options);

}  // namespace rio_t
