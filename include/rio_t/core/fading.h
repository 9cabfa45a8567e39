#pragma once

#include <algorithm>
#include <cmath>

#include "rio_t/core/time.h"

namespace rio_t {

/// What a sum that forgets within `memory` [s] keeps from `last` to `now`. Late data fade nothing, and no
/// pause fades all.
inline double fading(Time last, Time now, double memory) {
  return std::exp(-std::clamp(now - last, 0.0, 10.0 * memory) / memory);
}

}  // namespace rio_t
