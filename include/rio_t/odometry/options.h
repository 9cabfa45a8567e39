#pragma once

#include <vector>

#include "rio_t/imu/input_check.h"
#include "rio_t/imu/noise.h"
#include "rio_t/imu/rest_detector.h"
#include "rio_t/imu/static_initializer.h"
#include "rio_t/landmarks/options.h"
#include "rio_t/odometry/health_monitor.h"
#include "rio_t/odometry/motion_initializer.h"
#include "rio_t/sensors/barometer_channel.h"
#include "rio_t/sensors/ground_vehicle_channel.h"
#include "rio_t/sensors/innovation_gate.h"
#include "rio_t/sensors/offset_step_detector.h"
#include "rio_t/sensors/radar_channel.h"
#include "rio_t/smoother/options.h"

namespace rio_t {

/// How the first state is found.
enum class InitMode {
  kStatic,  ///< "static": wait for rest, however long
  kMotion,  ///< "motion": from radar velocities and IMU at once, moving or not
  kAuto,    ///< "auto": from rest; as kMotion after `init_motion_after` without rest
};

/// All options of the estimator. The defaults suit an ADIS16448 and a TI IWR6843AOP.
struct OdometryOptions {
  double gravity = 9.81;  ///< [m/s^2] magnitude
  ImuNoise imu_noise;
  InitMode init_mode = InitMode::kAuto;
  double init_motion_after = 5.0;  ///< [s] of IMU without rest, for kAuto
  StaticInitializerOptions initialization;
  MotionInitializerOptions motion_initialization;
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

  RadarOptions radar;                ///< the only one
  std::vector<RadarOptions> radars;  ///< several, by RadarScan::radar. Empty: `radar` alone
  std::size_t radarCount() const { return radars.empty() ? 1 : radars.size(); }
  const RadarOptions& ofRadar(std::size_t k) const { return radars.empty() ? radar : radars.at(k); }
};

/// The options that may change while the estimator runs, for all radars.
struct Tuning {
  ImuNoise imu_noise;
  InnovationGateOptions innovation_gate;
};
inline Tuning tuningOf(const OdometryOptions& options) {
  return {options.imu_noise, options.innovation_gate};
}
inline void apply(const Tuning& tuning, OdometryOptions& options) {
  options.imu_noise = tuning.imu_noise;
  options.innovation_gate = tuning.innovation_gate;
}

}  // namespace rio_t
