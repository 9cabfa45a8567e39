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

/// An initialiser returns this while it has not started the estimate.
struct StartWait {
  StartObstacle obstacle = StartObstacle::kTooFewData;
  std::string text;  ///< tells people what the initialiser waits for
};

}  // namespace rio_t
