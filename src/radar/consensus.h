#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "rio_t/radar/ego_velocity.h"

namespace rio_t {

constexpr double kMajority = 0.6;    ///< of the points
constexpr double kUnanimous = 0.85;  ///< of the points

/// Draws needed so that one is free of outliers with the wanted probability (Fischler and Bolles, 1981).
int ransacIterations(const EgoVelocityOptions& options);

/// The velocity that most points agree with. The candidates are rest and the velocities of three random
/// points each. Each point costs its squared residual up to the threshold (MSAC), so that among equally many
/// inliers the better fit wins. `points` has at least three. None if no three drawn points span 3D. With a
/// span, each Doppler counts modulo the span, and the drawn ones may have wrapped around to either side.
std::optional<Eigen::Vector3d> ransac(const std::vector<RadarDirection>& points,
                                      const EgoVelocityOptions& options, int iterations, double span);

/// Points that agree with `v_R`: within the threshold, or, with `ego_velocity_solver: eiv`, within three
/// sigma of Doppler and direction together.
std::vector<RadarDirection> selectInliers(const std::vector<RadarDirection>& points,
                                          const Eigen::Vector3d& v_R, const PointVariances& noise,
                                          const EgoVelocityOptions& options);

/// Returns `inliers`. If their velocity contradicts the prior, and enough other points agree on one that does
/// not, returns those points instead.
std::vector<RadarDirection> selectInliersWithPrior(const std::vector<RadarDirection>& points,
                                                   std::vector<RadarDirection> inliers,
                                                   const VelocityPrior& prior, const PointVariances& noise,
                                                   const EgoVelocityOptions& options);

}  // namespace rio_t
