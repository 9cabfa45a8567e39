#pragma once

#include "rio_t/factors/extrinsics_manifold.h"
#include "rio_t/factors/radar_motion.h"
#include "rio_t/graph/solver.h"
#include "rio_t/radar/extrinsics.h"

namespace rio_t {

/// The kind of term that a scan adds to the window.
enum class RadarFactor {
  kVelocity,  ///< the ego-velocity of the scan (the paper)
  kDoppler,   ///< the Doppler of each point, tightly coupled
};

struct SmootherOptions {
  double window = 1.0;           ///< [s] length of the fixed-lag window
  double huber_threshold = 1.5;  ///< on the whitened radar residual's norm; 0 = no robust loss
  RadarFactor radar_factor = RadarFactor::kDoppler;
  WindowSolver solver = WindowSolver::kChain;
  int max_iterations = 30;  ///< of the solver, each scan

  bool estimate_time_offset = true;  ///< false: LC-RIO, offset fixed at time_offset_initial
  TimeOffsetModel time_offset_model = TimeOffsetModel::kImu;
  double time_offset_noise = 2.0e-5;  ///< [s/sqrt(s)] random walk of the offset between its steps
  /// [m/s^2] A scan with less acceleration gives no information about the offset: at rest and at constant
  /// velocity the derivative is only noise.
  double time_offset_min_acceleration = 0.2;
  double max_time_offset = 0.25;    ///< [s] bound on |t_O|
  bool time_offset_shared = false;  ///< all radars have one clock and so one t_O

  EstimateExtrinsics estimate_extrinsics = EstimateExtrinsics::kNone;
  double extrinsics_rotation_sigma = 0.17;       ///< [rad] prior, per axis: 10 degrees
  double extrinsics_rotation_noise = 1.0e-5;     ///< [rad/sqrt(s)] random walk, per axis
  double extrinsics_translation_noise = 1.0e-5;  ///< [m/sqrt(s)] likewise

  double prior_sigma_yaw = 1.0e-3;       ///< [rad] yaw defines the world frame
  double prior_sigma_position = 1.0e-3;  ///< [m] position defines the world frame
  double prior_sigma_velocity = 0.02;    ///< [m/s]
  /// [rad/s] besides the noise of the mean at rest: the in-run stability of an ADIS16448, 14.5 deg/h
  double prior_sigma_gyro_bias = 7.0e-5;
  double prior_sigma_accel_bias = 0.1;  ///< [m/s^2]
};

/// The calibration of one radar as configured: the estimate starts there, with these sigmas.
struct CalibrationPrior {
  Extrinsics T_IR;
  double time_offset_initial = 0.0;            ///< [s]
  double time_offset_sigma = 0.075;            ///< [s] also of a step
  double extrinsics_translation_sigma = 0.05;  ///< [m] per axis
};

}  // namespace rio_t
