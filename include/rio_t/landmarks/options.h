#pragma once

#include <cstddef>

namespace rio_t {

struct LandmarkOptions {
  bool enabled = false;
  std::size_t max_landmarks = 24;  ///< in the window at once; the cost grows with the square and more
  double range_sigma = 0.05;       ///< [m] of a point; the noise of its angles is what PointNoise learns
};

}  // namespace rio_t
