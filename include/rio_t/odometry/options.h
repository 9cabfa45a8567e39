#pragma once

#include <vector>

#include "rio_t/imu/input_check.h"
#include "rio_t/imu/noise.h"
#include "rio_t/imu/rest_detector.h"
#include "rio_t/imu/static_initializer.h"
#include "rio_t/landmarks/options.h"
#include "rio_t/odometry/health_monitor.h"
#include "rio_t/odometry/motion_initializer.h"
#include "rio_t/radar/ego_velocity.h"
#include "rio_t/radar/extrinsics.h"
#include "rio_t/sensors/barometer_channel.h"
#include "rio_t/sensors/ground_vehicle_channel.h"
#include "rio_t/sensors/innovation_gate.h"
#include "rio_t/sensors/offset_step_detector.h"
#include "rio_t/smoother/options.h"

namespace rio_t {

/// How the first state is found.
enum class InitMode {
  kStatic,  ///< "static": wait for rest, however long
  kMotion,  ///< "motion": from radar velocities and IMU at once, moving or not
  kAuto,    ///< "auto": from rest; as kMotion after `init_motion_after` without rest
};

/// The options that each of several radars has for itself.
struct RadarOptions {
  Extrinsics T_IR;
  EgoVelocityOptions ego_velocity;
  double time_offset_initial = 0.0;            ///< [s]
  double time_offset_sigma = 0.075;            ///< [s] prior
  double extrinsics_translation_sigma = 0.05;  ///< [m] prior, per axis
};

/// All options of the estimator. The defaults suit an ADIS16448 and a TI IWR6843AOP.
struct OdometryOptions {
  double gravity = 9.81;  ///< [m/s^2] magnitude
  ImuNoise imu_noise;
  Extrinsics T_IR;
  InitMode init_mode = InitMode::kAuto;
  double init_motion_after = 5.0;  ///< [s] of IMU without rest, for kAuto
  StaticInitializerOptions initialization;
  MotionInitializerOptions motion_initialization;
  EgoVelocityOptions ego_velocity;
  RestOptions rest;
  SmootherOptions smoother;
  InnovationGateOptions innovation_gate;
  LandmarkOptions landmarks;
  OffsetStepDetectorOptions offset_step_detector;
  HealthOptions health;
  Platform platform = Platform::kFree;
  GroundVehicleOptions ground_vehicle;  ///< if the platform is one
  bool use_barometer = false;           ///< false: pressures are not taken
  BarometerOptions barometer;
  /// [s] between samples; a longer gap is counted and widens the uncertainty
  double max_imu_gap = 0.04;
  ImuInputCheckOptions imu_input_check;
  double max_radar_gap = 0.5;         ///< [s] without a scan; a longer gap is counted
  std::size_t max_queued_scans = 50;  ///< scans that may wait for the IMU or the solver

  /// Several radars, by RadarScan::radar. Empty: one, with the members above.
  std::vector<RadarOptions> radars;
  std::size_t radarCount() const { return radars.empty() ? 1 : radars.size(); }
};

/// The options that may change while the estimator runs, for all radars.
struct Tuning {
  ImuNoise imu_noise;
  InnovationGateOptions innovation_gate;
};
Tuning tuningOf(const OdometryOptions& options);
void apply(const Tuning& tuning, OdometryOptions& options);

/// The options as one radar has them: without `radars`, and with those that this radar has for itself.
OdometryOptions optionsOfRadar(const OdometryOptions& options, std::size_t radar);

}  // namespace rio_t
