#pragma once

#include <stdexcept>
#include <string>

#include "rio_t/core/format.h"

namespace rio_t::simulation {

/// A simulation keeps all samples in memory, about 200 bytes each. So many take 20 GB.
constexpr double kMostSamples = 1e8;
/// [s] Built-in motions have 100 poses a second.
constexpr double kLongest = 0.01 * kMostSamples;

/// Throws std::invalid_argument if `rate` [Hz] gives more than kMostSamples in `duration` [s]. `option`: of
/// the rate, on the command line.
inline void checkSampleCount(const char* option, double rate, double duration) {
  if (rate * duration <= kMostSamples) return;
  throw std::invalid_argument(
      formatted("--%s: %g Hz for %g s; expected at most %g Hz, which gives %g samples", option, rate,
                duration, kMostSamples / duration, kMostSamples));
}

}  // namespace rio_t::simulation
