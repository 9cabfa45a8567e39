#pragma once

#include <Eigen/Core>

#include "rio_t/radar/extrinsics.h"
#include "rio_t/sensors/radar_channel.h"

namespace rio_t {

/// How far a radar that is held where it was configured seems to be turned from there, about the axes of I.
struct MountingTurn {
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();        ///< [rad]
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< [rad^2]
  Eigen::Vector3d sigma() const { return covariance.diagonal().cwiseSqrt(); }
};

/// Checks the mountings that the estimator holds where they were configured. A wrong mounting leaves a
/// pattern in the innovations: a platform that turns seems to accelerate, and two radars contradict each
/// other. A least-squares fit finds the turns of all radars that explain the pattern best. It neglects that
/// tilt and biases follow a wrong mounting, too, so a turn may come out short. Source: Friedland, "Treatment
/// of Bias in Recursive Filtering", IEEE TAC 1969, with the turns as bias (docs/method.md, section 5.8). Not
/// thread-safe.
class MountingCheck {
 public:
  explicit MountingCheck(std::size_t radars);

  /// The innovation of a scan that went into the window.
  void add(std::size_t radar, const UsedInnovation& innovation);
  /// Call it at rest and at a new start: the velocity then does not depend on the mountings.
  void velocityKnown() { dv_W_.setZero(); }
  MountingTurn turnOf(std::size_t radar, const Extrinsics& configured) const;

 private:
  // By the turns of all radars, about the axes of each radar.
  Eigen::MatrixXd dv_W_;         ///< how they change the estimated velocity, 3 rows [m/s]
  Eigen::MatrixXd information_;  ///< about them
  Eigen::VectorXd score_;        ///< information_ times the likeliest turns
};

}  // namespace rio_t
