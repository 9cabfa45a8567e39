#pragma once

#include <optional>
#include <string>
#include <vector>

#include "rio_t/core/pose.h"
#include "rio_t/factors/doppler_factor.h"
#include "rio_t/graph/solver_termination.h"
#include "rio_t/landmarks/landmark_answer.h"
#include "rio_t/odometry/health_monitor.h"
#include "rio_t/odometry/navigation_state.h"
#include "rio_t/radar/ego_velocity.h"
#include "rio_t/radar/scan.h"
#include "rio_t/sensors/barometer_channel.h"
#include "rio_t/sensors/ground_vehicle_channel.h"
#include "rio_t/sensors/innovation.h"

namespace rio_t {

/// The result of one scan.
struct ScanResult {
  RadarScan scan;  ///< as fed
  EgoVelocity ego_velocity;
  /// The innovation of the velocity that its points show without the prediction; none if they do not decide.
  std::optional<Innovation> innovation;
  std::optional<DopplerMeasurement> doppler;    ///< its points, if they and not the velocity count
  double offset_gain = 0.0;                     ///< see OffsetEvidence; 0: the scan does not tell the offset
  double offset_half_width = kOffsetHalfWidth;  ///< of the mean of the IMU in the derivative [s]
  bool used = false;                            ///< it went into the window
  bool at_rest = false;                         ///< the IMU shows rest, and the points do not deny it
  double rest_velocity_sigma = 0.0;             ///< [m/s] of the zero velocity, if at rest
  std::optional<LandmarkAnswer> landmarks;      ///< if they are on, of a used scan in motion
  double model_error_scale = 1.0;               ///< see ModelErrorScale; in the covariance of ego_velocity
  std::string rejected_because;                 ///< snake case, empty if used; keys of `scans_rejected`

  /// The window was solved again, because the scan was used or the platform is at rest. If not, the following
  /// members are not set.
  bool updated = false;
  // The newest state of the window.
  NavigationState state;
  double time_offset = 0.0;        ///< t_O [s]
  double time_offset_sigma = 0.0;  ///< [s]
  Extrinsics T_IR;                 ///< of this radar
  /// Covariance of T_IR, if it is estimated; zero if not. Translation of the radar in I [m], then turn about
  /// the axes of I [rad]: the order of ROS.
  Eigen::Matrix<double, 6, 6> T_IR_covariance = Eigen::Matrix<double, 6, 6>::Zero();
  int solver_iterations = 0;
  SolverTermination solver_termination = SolverTermination::kIterationLimit;
  Health health = Health::kOk;                        ///< after this scan; set always
  bool offset_stepped = false;                        ///< t_O stepped before this scan
  bool reinitialized = false;                         ///< the estimate was re-initialised before this scan
  std::optional<GroundVehicleAnswer> ground_vehicle;  ///< if the constraint was judged at this scan
  std::vector<BarometerAnswer> barometer;  ///< means of pressures that were judged before this scan
  std::vector<StampedPose> left_window;    ///< optimised poses that this scan pushed out, oldest first
};

}  // namespace rio_t
