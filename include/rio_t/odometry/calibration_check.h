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
  /// Distance from zero in sigmas, if each axis may also be off by the sigma `tolerance`.
  double sigmas(double tolerance) const;
};

/// An error of one number.
struct ScalarError {
  double error = 0.0;
  double variance = 0.0;
  double sigma() const;
  double sigmas(double tolerance) const;  ///< as VectorError::sigmas
};

/// Errors of the configured calibration of one radar, as the scans show them. None for what is estimated.
struct CalibrationErrors {
  std::optional<VectorError> turn;  ///< of the mounting from the configured one, about the axes of I [rad]
  std::optional<VectorError> lever_arm;  ///< the true position of the radar in I minus the configured one [m]
  ScalarError scale;  ///< of the Doppler: the true velocity is (1 - error) times the measured one
  std::optional<ScalarError> offset;  ///< the true t_O minus the configured one [s]
};

/// Checks the calibration that the estimator does not estimate: mountings, lever arms, time offsets, and the
/// scale of the Dopplers. Each error leaves a pattern in the innovations. With a wrong mounting, a platform
/// that turns seems to accelerate, and two radars contradict each other. With a wrong lever arm, its velocity
/// seems to change with each turn. With a wrong scale it seems to accelerate more or less than the IMU
/// measures, with a wrong offset sooner or later. A least-squares fit finds the errors of all radars that
/// explain the pattern best. It neglects that tilt and biases follow, too, so it may find too small errors.
/// Source: Friedland, "Treatment of Bias in Recursive Filtering", IEEE TAC 1969, with the errors as bias
/// (docs/method.md, section 5.8). Not thread-safe.
class CalibrationCheck {
 public:
  explicit CalibrationCheck(std::size_t radars);

  /// Adds the innovation of a scan that went into the window.
  void add(std::size_t radar, const UsedInnovation& innovation);
  /// Call it at rest and at a new start: the velocity then does not depend on the calibration.
  void velocityKnown() { dv_W_.setZero(); }
  /// All errors of that radar, also of what is estimated. `configured` is its mounting.
  CalibrationErrors errorsOf(std::size_t radar, const Extrinsics& configured) const;

 private:
  // The columns are the errors of all radars. Each radar has the turn about its axes, the lever arm along
  // them, the scale of the Doppler, and the offset.
  Eigen::MatrixXd dv_W_;         ///< how they change the estimated velocity, 3 rows [m/s]
  Eigen::MatrixXd information_;  ///< about them
  Eigen::VectorXd score_;        ///< information_ times the likeliest errors
  /// By radar: noise may add up to this to the score of its scale, if P is much too large or too small in S.
  Eigen::VectorXd score_bias_;
  std::vector<TurningAxes> turning_;  ///< by radar, about its own axes
};

}  // namespace rio_t
