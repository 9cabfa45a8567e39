#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace rio_t {

/// The `share` quantile of the values by nearest rank, such as 0.5 for the median; 0 if there are none.
inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const double last = static_cast<double>(values.size() - 1);
  const auto at = values.begin() + std::lround(std::clamp(share, 0.0, 1.0) * last);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace rio_t
