#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "rio_t/core/time.h"

namespace rio_t {

/// Difference between the measured and the predicted velocity of a scan. All decisions about the scan judge
/// this one value.
struct Innovation {
  Time stamp;
  Eigen::Vector3d d = Eigen::Vector3d::Zero();      ///< measured minus predicted velocity, in R [m/s]
  Eigen::Matrix3d S = Eigen::Matrix3d::Identity();  ///< covariance of d [m^2/s^2]
  Eigen::Matrix3d S_at_offset = Eigen::Matrix3d::Identity();  ///< the same if the offset were known
  // Derivatives of the velocity with respect to t_O [m/s^2]. d contains the noise of the IMU before the scan.
  // J_after does not contain this noise. J_mean does: use only the part of it that the estimate has not
  // followed, in which the noise cancels (docs/method.md, eq. 18h).
  Eigen::Vector3d J_after = Eigen::Vector3d::Zero();  ///< from the samples after the scan
  Eigen::Vector3d J_mean = Eigen::Vector3d::Zero();   ///< from both sides

  double squaredSigmas() const { return d.dot(S.ldlt().solve(d)); }
  /// The same with `sigma` [m/s] added to each axis of S.
  Innovation widened(double sigma) const {
    Innovation wide = *this;
    wide.S.diagonal().array() += sigma * sigma;
    return wide;
  }
};

}  // namespace rio_t
