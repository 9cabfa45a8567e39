#pragma once

#include <Eigen/Core>

#include "rio_t/odometry/navigation_state.h"

namespace rio_t {

/// What is not known of position and heading where the state was found anew. Nothing ever observes them, so
/// they only add to what is published: inside the window, a position known to hundreds of metres would cost
/// the digits of all else, and a heading left free would wander.
class PoseDoubt {
 public:
  PoseDoubt() = default;
  /// All that `published` says of position and heading; from its position on the heading's doubt spreads.
  explicit PoseDoubt(const NavigationState& published);
  void addTo(NavigationState& state) const;

 private:
  Eigen::Matrix3d position_ = Eigen::Matrix3d::Zero();  ///< [m^2] in W
  double heading_ = 0.0;                                ///< [rad^2]
  Eigen::Vector3d pivot_W_ = Eigen::Vector3d::Zero();   ///< [m]
};

}  // namespace rio_t
