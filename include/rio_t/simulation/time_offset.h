#pragma once

#include <vector>

namespace rio_t::simulation {

/// t_O over time: a scan stamped s was measured at s - t_O(s). Positive: the stamp is late.
struct TimeOffsetProfile {
  struct Step {
    double time;    ///< [s] from the start of the bag; holds for stamps from here on
    double change;  ///< [s]
  };

  double constant = 0.0;  ///< [s]
  double drift = 0.0;     ///< [s/s], counted from the start of the bag
  std::vector<Step> steps;

  /// Offset [s] of a scan stamped `stamp` seconds after the start.
  double at(double stamp) const {
    double offset = constant + drift * stamp;
    for (const Step& step : steps) {
      if (stamp >= step.time) offset += step.change;
    }
    return offset;
  }
};

}  // namespace rio_t::simulation
