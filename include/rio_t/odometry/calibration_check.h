#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "rio_t/imu/turning_axes.h"
#include "rio_t/radar/extrinsics.h"
#include "rio_t/sensors/radar_channel.h"

namespace rio_t {

/// An error of three numbers.
struct VectorError {
  Eigen::Vector3d error = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  Eigen::Vector3d sigma() const { return covariance.diagonal().cwiseSqrt(); }
  /// How far it is from zero, if each axis may be off by `told_sigma` besides.
  double sigmas(double told_sigma) const;
};

/// An error of one number.
struct ScalarError {
  double error = 0.0;
  double variance = 0.0;
  double sigma() const;
  double sigmas(double told_sigma) const;  ///< as VectorError::sigmas
};

/// How far the configured calibration of one radar seems to be off. What is estimated has no error here.
struct CalibrationErrors {
  std::optional<VectorError> turn;  ///< of the mounting from the configured one, about the axes of I [rad]
  std::optional<VectorError> lever_arm;  ///< the true position of the radar in I less the configured one [m]
  ScalarError scale;  ///< of the Doppler: the true velocity is (1 - error) times the measured one
  std::optional<ScalarError> offset;  ///< the true t_O less the configured one [s]
};

/// Checks what the estimator holds where it was configured: mountings, lever arms, time offsets, and the
/// scale of the Dopplers. Each error leaves a pattern in the innovations. With a wrong mounting, a platform
/// that turns seems to accelerate, and two radars contradict each other. With a wrong lever arm, its velocity
/// seems to change with each turn. With a wrong scale it seems to accelerate more or less than the IMU feels,
/// with a wrong offset sooner or later. A least-squares fit finds the errors of all radars that explain the
/// pattern best. It neglects that tilt and biases follow these errors, too, so they may come out short.
/// Source: Friedland, "Treatment of Bias in Recursive Filtering", IEEE TAC 1969, with the errors as bias
/// (docs/method.md, section 5.8). Not thread-safe.
class CalibrationCheck {
 public:
  explicit CalibrationCheck(std::size_t radars);

  /// The innovation of a scan that went into the window.
  void add(std::size_t radar, const UsedInnovation& innovation);
  /// Call it at rest and at a new start: the velocity then does not depend on the calibration.
  void velocityKnown() { dv_W_.setZero(); }
  /// All errors of that radar, also of what is estimated. `configured` is its mounting.
  CalibrationErrors errorsOf(std::size_t radar, const Extrinsics& configured) const;

 private:
  // By the errors of all radars: for each the turn about the axes of the radar, the lever arm along them, the
  // scale of the Doppler, and the offset.
  Eigen::MatrixXd dv_W_;         ///< how they change the estimated velocity, 3 rows [m/s]
  Eigen::MatrixXd information_;  ///< about them
  Eigen::VectorXd score_;        ///< information_ times the likeliest errors
  /// By radar: what noise alone may add to the score of its scale, if P is much too large or too small in S.
  Eigen::VectorXd alike_;
  std::vector<TurningAxes> turning_;  ///< by radar, about its own axes
};

}  // namespace rio_t
