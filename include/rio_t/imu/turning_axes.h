#pragma once

#include <Eigen/Core>

namespace rio_t {

/// Finds the axes about which a platform turns from means of its gyro. About the other axes there is only
/// noise, which would look like a turn that shows the lever arm (docs/method.md, section 5.8).
class TurningAxes {
 public:
  /// A mean of the angular velocity [rad/s] and the variance of its noise, about each axis [rad^2/s^2].
  void add(const Eigen::Vector3d& omega, double variance) {
    squares_ += omega * omega.transpose();
    noise_ += variance;
  }
  /// Projection onto these axes.
  Eigen::Matrix3d projection() const;

 private:
  Eigen::Matrix3d squares_ = Eigen::Matrix3d::Zero();
  double noise_ = 0.0;
};

}  // namespace rio_t
