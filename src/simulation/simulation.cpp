#include "rio_t/simulation/simulation.h"

#include <cmath>
#include <stdexcept>

namespace rio_t::simulation {

SensorData simulate(const Motion& motion, const SimulationOptions& options) {
  return {
      simulateImu(motion, options.imu, options.seed, options.start),
      simulateRadar(motion, options.radar, options.time_offset, options.T_IR, options.seed, options.start)};
}

Trajectory groundTruth(const Motion& motion, double rate, Time start) {
  if (!(rate > 0.0)) throw std::invalid_argument("ground truth: rate must be positive");
  Trajectory poses;
  const auto count = static_cast<std::size_t>(std::floor(motion.duration() * rate)) + 1;
  poses.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    StampedPose pose;
    pose.time = start + static_cast<double>(i) / rate;
    const MotionState state = motion.at(pose.time - start);
    pose.p_W = state.p_W;
    pose.q_WI = state.q_WI;
    poses.push_back(pose);
  }
  return poses;
}

}  // namespace rio_t::simulation
