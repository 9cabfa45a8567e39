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
  return result;
}

Tuning tuningOf(const OdometryOptions& options) {
  const SmootherOptions& smoother = options.smoother;
  return {options.imu_noise, smoother.innovation_gate, smoother.innovation_model_error,
          smoother.innovation_gate_timeout};
}

void apply(const Tuning& tuning, OdometryOptions& options) {
  options.imu_noise = tuning.imu_noise;
  options.smoother.innovation_gate = tuning.innovation_gate;
  options.smoother.innovation_model_error = tuning.innovation_model_error;
  options.smoother.innovation_gate_timeout = tuning.innovation_gate_timeout;
}

}  // namespace rio_t
