#pragma once

#include <string>

namespace rio_t {

/// Why the estimate has not started.
enum class StartObstacle {
  kTooFewData,     ///< nothing stands against it so far
  kMotion,         ///< the platform does not rest
  kWrongGravity,   ///< the mean accelerometer does not read gravity
  kContradiction,  ///< radar and IMU contradict each other
};

/// What the start is waiting for.
struct StartWait {
  StartObstacle obstacle = StartObstacle::kTooFewData;
  std::string text;  ///< tells people
};

}  // namespace rio_t
