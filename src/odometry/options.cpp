#include "rio_t/odometry/options.h"

namespace rio_t {

OdometryOptions optionsOfRadar(const OdometryOptions& options, std::size_t radar) {
  OdometryOptions result = options;
  result.radars.clear();
  if (options.radars.empty()) return result;
  const RadarOptions& particular = options.radars.at(radar);
  result.T_IR = particular.T_IR;
  result.ego_velocity = particular.ego_velocity;
  result.smoother.time_offset_initial = particular.time_offset_initial;
  result.smoother.time_offset_sigma = particular.time_offset_sigma;
  result.smoother.extrinsics_translation_sigma = particular.extrinsics_translation_sigma;
  return result;
}

Tuning tuningOf(const OdometryOptions& options) { return {options.imu_noise, options.innovation_gate}; }

void apply(const Tuning& tuning, OdometryOptions& options) {
  options.imu_noise = tuning.imu_noise;
  options.innovation_gate = tuning.innovation_gate;
}

}  // namespace rio_t
