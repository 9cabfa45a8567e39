#pragma once

#include <Eigen/Core>

#include "rio_t/odometry/navigation_state.h"

namespace rio_t {

/// Uncertainty of position and heading that a re-initialisation keeps. No sensor observes them, so it is
/// added only to what is published.
class PoseInflation {
 public:
  PoseInflation() = default;
  /// Keeps the uncertainty of position and heading of `published`. That of the heading spreads from this
  /// position on.
  explicit PoseInflation(const NavigationState& published);
  /// The position has drifted by this variance per axis [m^2].
  void addPosition(double variance) { position_.diagonal().array() += variance; }
  void addTo(NavigationState& state) const;

 private:
  Eigen::Matrix3d position_ = Eigen::Matrix3d::Zero();  ///< [m^2] in W
  double heading_ = 0.0;                                ///< [rad^2]
  Eigen::Vector3d pivot_W_ = Eigen::Vector3d::Zero();   ///< [m]
};

/// Uncertainty of the yaw that gaps and saturation of the IMU caused. No sensor observes the yaw, so this
/// uncertainty stays. A window linearised at different yaws would lose it; therefore it is added to what is
/// published.
class YawInflation {
 public:
  /// `variance` [rad^2] gained at the place `p_W` [m].
  void add(double variance, const Eigen::Vector3d& p_W);
  void addTo(NavigationState& state) const;

 private:
  double variance_ = 0.0;                                ///< [rad^2] since the start
  Eigen::Vector3d lost_at_W_ = Eigen::Vector3d::Zero();  ///< [m] where the last of it was gained
};

}  // namespace rio_t
