#pragma once

#include <optional>
#include <vector>

#include "rio_t/core/pose.h"
#include "rio_t/graph/solver.h"
#include "rio_t/landmarks/landmark_answer.h"
#include "rio_t/odometry/calibration_check.h"
#include "rio_t/odometry/health_monitor.h"
#include "rio_t/odometry/navigation_state.h"
#include "rio_t/radar/scan.h"
#include "rio_t/sensors/barometer_channel.h"
#include "rio_t/sensors/ground_vehicle_channel.h"
#include "rio_t/sensors/radar_channel.h"

namespace rio_t {

/// The result of one scan.
struct ScanResult : ScanAnswer {
  RadarScan scan;                           ///< as fed
  bool used = false;                        ///< it went into the window
  double rest_velocity_sigma = 0.0;         ///< [m/s] of the zero velocity, if at rest
  std::optional<LandmarkAnswer> landmarks;  ///< if they are on, of a used scan in motion
  double model_error_scale = 1.0;           ///< see ModelErrorScale; in the covariance of ego_velocity

  /// The window was solved again: the scan was used, the platform is at rest, or the constraint of a vehicle
  /// was added. If not, the members up to solver_termination are not set.
  bool updated = false;
  // The newest state of the window.
  NavigationState state;
  double time_offset = 0.0;        ///< t_O [s]
  double time_offset_sigma = 0.0;  ///< [s]
  Extrinsics T_IR;                 ///< of this radar
  Extrinsics configured_T_IR;      ///< the mounting of the options
  CalibrationErrors errors;        ///< of the calibration that is not estimated
  /// Covariance of T_IR, if it is estimated; zero if not. Translation of the radar in I [m], then turn about
  /// the axes of I [rad]: the order of ROS.
  Eigen::Matrix<double, 6, 6> T_IR_covariance = Eigen::Matrix<double, 6, 6>::Zero();
  int solver_iterations = 0;
  SolverTermination solver_termination = SolverTermination::kIterationLimit;

  // Set for each scan.
  Health health = Health::kOk;   ///< after this scan
  bool is_contradicted = false;  ///< diverged, and not only because the velocity is unknown
  bool reinitialized = false;    ///< the estimate was re-initialised before this scan
  std::optional<GroundVehicleAnswer> ground_vehicle;  ///< if the constraint was judged at this scan
  std::vector<BarometerAnswer> barometer;  ///< means of pressures that were judged before this scan
  std::vector<StampedPose> left_window;    ///< optimised poses that this scan pushed out, oldest first
};

}  // namespace rio_t
