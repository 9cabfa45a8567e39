#include "rio_t/simulation/simulation.h"

#include <cmath>
#include <stdexcept>

#include "rio_t/radar/scan.h"
#include "rio_t/simulation/random.h"
#include "rio_t/simulation/sample_count.h"

namespace rio_t::simulation {
namespace {

constexpr std::uint64_t kNamedRadarStream = 30;

// The seed depends on the name alone, so that a radar does not depend on the others. FNV-1a, since std::hash
// differs from library to library.
std::uint64_t seedOf(const std::string& name, std::uint64_t seed) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return Random(seed, kNamedRadarStream, hash).bits();
}

}  // namespace

SensorData simulate(const Motion& motion, const SimulationOptions& options) {
  SensorData data;
  data.imu = simulateImu(motion, options.imu, options.seed, options.start);
  data.pressures = simulateBarometer(motion, options.barometer, options.seed, options.start);
  if (options.radars.empty()) data.scans = simulateRadar(motion, options, options.seed, options.start);
  for (const auto& [name, setup] : options.radars) {
    try {
      if (!isRadarName(name))
        throw std::invalid_argument("the name must be of lower case letters, digits and underscores");
      data.radars[name] = simulateRadar(motion, setup, seedOf(name, options.seed), options.start);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("radar '" + name + "': " + error.what());
    }
  }
  return data;
}

Trajectory groundTruth(const Motion& motion, double rate, Time start) {
  if (!(rate > 0.0)) throw std::invalid_argument("ground truth: rate must be positive");
  checkSampleCount("ground-truth-file-rate", rate, motion.duration());
  Trajectory poses;
  const auto count = static_cast<std::size_t>(std::floor(motion.duration() * rate)) + 1;
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
