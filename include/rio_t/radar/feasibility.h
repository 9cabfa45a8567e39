#pragma once

#include <Eigen/Core>
#include <deque>

#include "rio_t/core/time.h"

namespace rio_t {

struct FeasibilityOptions {
  double window = 0.5;             ///< [s] length of the sliding average
  double max_acceleration = 30.0;  ///< [m/s^2] the radar's velocity cannot leave the average faster
  double margin = 0.5;             ///< [m/s] always allowed
};

/// Sliding-average check of the ego-velocity (paper, section II-B1): discards jumps no platform can make.
class FeasibilityCheck {
 public:
  explicit FeasibilityCheck(const FeasibilityOptions& options) : options_(options) {}
  /// True if `v_R` at `stamp` can follow the velocities before; a feasible velocity joins the average. A
  /// rejected one does not join, but the average ages, so the check never locks out for longer than the
  /// window.
  bool accept(Time stamp, const Eigen::Vector3d& v_R);

 private:
  struct Entry {
    Time stamp;
    Eigen::Vector3d v_R;
  };
  FeasibilityOptions options_;  // read-only after construction
  std::deque<Entry> accepted_;
};

}  // namespace rio_t
