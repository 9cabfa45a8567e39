#include "rio_t/odometry/options.h"

namespace rio_t {

Tuning tuningOf(const OdometryOptions& options) { return {options.imu_noise, options.innovation_gate}; }

void apply(const Tuning& tuning, OdometryOptions& options) {
  options.imu_noise = tuning.imu_noise;
  options.innovation_gate = tuning.innovation_gate;
}

}  // namespace rio_t
