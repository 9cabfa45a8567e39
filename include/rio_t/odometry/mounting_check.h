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

/// How far the velocities of a radar seem to be scaled, as by a Doppler that is not in m/s.
struct DopplerScale {
  double error = 0.0;     ///< the true velocity is (1 - error) times the measured one
  double variance = 0.0;  ///< of the error
};

/// Checks the mountings that the estimator holds where they were configured, and the scale of the Dopplers. A
/// wrong mounting leaves a pattern in the innovations: a platform that turns seems to accelerate, and two
/// radars contradict each other. A wrong scale does so, too: the platform seems to accelerate more or less
/// than the IMU feels. A least-squares fit finds the turns and scales of all radars that explain the pattern
/// best. It neglects that tilt and biases follow these errors, too, so they may come out short. Source:
/// Friedland, "Treatment of Bias in Recursive Filtering", IEEE TAC 1969, with the errors as bias
/// (docs/method.md, section 5.8). Not thread-safe.
class MountingCheck {
 public:
  explicit MountingCheck(std::size_t radars);

  /// The innovation of a scan that went into the window.
  void add(std::size_t radar, const UsedInnovation& innovation);
  /// Call it at rest and at a new start: the velocity then does not depend on the mountings.
  void velocityKnown() { dv_W_.setZero(); }
  MountingTurn turnOf(std::size_t radar, const Extrinsics& configured) const;
  DopplerScale scaleOf(std::size_t radar) const;

 private:
  Eigen::MatrixXd covariance() const;

  // By the errors of all radars: the turns about the axes of the radar, and the scale of its Doppler.
  Eigen::MatrixXd dv_W_;         ///< how they change the estimated velocity, 3 rows [m/s]
  Eigen::MatrixXd information_;  ///< about them
  Eigen::VectorXd score_;        ///< information_ times the likeliest errors
  /// By radar: what noise alone may add to the score of its scale, if P is much too large or too small in S.
  Eigen::VectorXd alike_;
};

}  // namespace rio_t
