#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rio_t/simulation/motion.h"

namespace rio_t::simulation {

struct MotionDescription {
  std::string name;
  std::string summary;      ///< one line for people
  double default_duration;  ///< [s], rest included
};

const std::vector<MotionDescription>& builtInMotions();

struct MotionRequest {
  std::string name;
  std::uint64_t seed = 0;
  double duration = 0.0;   ///< [s] with rest; 0 = the motion's default
  MotionRestOptions rest;  ///< `start_in_motion` ignores `static_start`
  /// [m/s] of `constant_speed`, 1 if not given, and of `walk` between its turns, 1.3 if not given. The other
  /// motions have speeds of their own.
  std::optional<double> speed = std::nullopt;
};

/// Builds a built-in motion: the same request gives the same motion. Starts near the origin, IMU level at
/// rest for all but the tilted hand-held ones. Throws std::invalid_argument for an unknown name (the message
/// lists the known ones), a duration that leaves less than 5 s between the rests or is above kLongest, or a
/// speed that is not positive or that the motion cannot take.
Motion makeMotion(const MotionRequest& request);

}  // namespace rio_t::simulation
