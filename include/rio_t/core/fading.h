#pragma once

#include <algorithm>
#include <cmath>

#include "rio_t/core/time.h"

namespace rio_t {

/// A sum that forgets with the time constant `memory` [s] is multiplied by this factor from `last` to `now`.
/// The factor is 1 for data that come late, and it is never zero.
inline double fading(Time last, Time now, double memory) {
  return std::exp(-std::clamp(now - last, 0.0, 10.0 * memory) / memory);
}

}  // namespace rio_t
