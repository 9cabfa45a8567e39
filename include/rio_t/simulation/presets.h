#pragma once

#include <string>
#include <vector>

#include "rio_t/simulation/simulation.h"

namespace rio_t::simulation {

/// A platform with its sensors: what differs from the defaults of the simulator.
struct Preset {
  std::string name;
  std::string summary;        ///< one line for people
  std::string motion;         ///< a built-in one
  double duration = 0.0;      ///< [s] with rest; 0 = the motion's own
  MotionRestOptions rest;     ///< at both ends of the motion
  SimulationOptions options;  ///< IMU, radars and mountings; seed, start and time offset are the defaults
};

std::vector<Preset> presets();

/// Throws std::invalid_argument for an unknown name; the message lists the known ones.
Preset presetOf(const std::string& name);

}  // namespace rio_t::simulation
