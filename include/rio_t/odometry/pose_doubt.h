#pragma once

#include <Eigen/Core>

#include "rio_t/odometry/navigation_state.h"

namespace rio_t {

/// Uncertainty of position and heading that a re-initialisation keeps. No sensor observes them, so it is
/// added only to what is published. Inside the window, a position known to hundreds of metres would cost the
/// digits of all other states, and a free heading would wander.
class PoseDoubt {
 public:
  PoseDoubt() = default;
  /// Keeps the uncertainty of position and heading of `published`. That of the heading spreads from this
  /// position on.
  explicit PoseDoubt(const NavigationState& published);
  void addTo(NavigationState& state) const;

 private:
  Eigen::Matrix3d position_ = Eigen::Matrix3d::Zero();  ///< [m^2] in W
  double heading_ = 0.0;                                ///< [rad^2]
  Eigen::Vector3d pivot_W_ = Eigen::Vector3d::Zero();   ///< [m]
};

}  // namespace rio_t
