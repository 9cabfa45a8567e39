#pragma once

#include <cmath>

namespace rio_t {

/// Probability that a value with the error `e` and the noise `sigma` falls into a bin of half width
/// `half_bin` around it (docs/method.md, eq. 19a, times the width).
inline double binProbability(double e, double sigma, double half_bin) {
  const auto beyond = [&](double edge) { return 0.5 * std::erfc(edge / sigma * M_SQRT1_2); };
  const double size = std::abs(e);  // the bin is even, and erfc is exact in its upper tail only
  return beyond(size - half_bin) - beyond(size + half_bin);
}

}  // namespace rio_t
