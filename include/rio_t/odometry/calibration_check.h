#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>

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

/// How far a time offset that is held seems to be off.
struct TimeOffsetError {
  double error = 0.0;     ///< the true t_O is larger by this [s]
  double variance = 0.0;  ///< of the error [s^2]
};

/// How far the configured calibration of one radar seems to be off.
struct CalibrationErrors {
  MountingTurn turn;
  DopplerScale scale;
  std::optional<TimeOffsetError> offset;  ///< none if the offsets are estimated
};

/// Checks what the estimator holds where it was configured: the mountings, the scale of the Dopplers and, if
/// they are not estimated, the time offsets. Each error leaves a pattern in the innovations. With a wrong
/// mounting, a platform that turns seems to accelerate, and two radars contradict each other. With a wrong
/// scale it seems to accelerate more or less than the IMU feels, with a wrong offset sooner or later. A
/// least-squares fit finds the errors of all radars that explain the pattern best. It neglects that tilt and
/// biases follow these errors, too, so they may come out short. Source: Friedland, "Treatment of Bias in
/// Recursive Filtering", IEEE TAC 1969, with the errors as bias (docs/method.md, section 5.8). Not
/// thread-safe.
class CalibrationCheck {
 public:
  CalibrationCheck(std::size_t radars, bool holds_offsets);

  /// The innovation of a scan that went into the window.
  void add(std::size_t radar, const UsedInnovation& innovation);
  /// Call it at rest and at a new start: the velocity then does not depend on the calibration.
  void velocityKnown() { dv_W_.setZero(); }
  /// `configured` is the mounting of that radar.
  CalibrationErrors errorsOf(std::size_t radar, const Extrinsics& configured) const;

 private:
  // The first column of each error of a radar.
  Eigen::Index turnAt(std::size_t radar) const { return each_ * static_cast<Eigen::Index>(radar); }
  Eigen::Index scaleAt(std::size_t radar) const { return turnAt(radar) + 3; }
  Eigen::Index offsetAt(std::size_t radar) const { return scaleAt(radar) + 1; }

  bool holds_offsets_;
  Eigen::Index each_;  ///< number of errors of a radar
  // By the errors of all radars: the turns about the axes of the radar, the scale of its Doppler, its offset.
  Eigen::MatrixXd dv_W_;         ///< how they change the estimated velocity, 3 rows [m/s]
  Eigen::MatrixXd information_;  ///< about them
  Eigen::VectorXd score_;        ///< information_ times the likeliest errors
  /// By radar: what noise alone may add to the score of its scale, if P is much too large or too small in S.
  Eigen::VectorXd alike_;
};

}  // namespace rio_t
