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
  Eigen::Vector3d J_O = Eigen::Vector3d::Zero();              ///< change of the velocity with t_O [m/s^2]

  double squaredSigmas() const { return d.dot(S.ldlt().solve(d)); }
  /// The same with `sigma` [m/s] added on each axis of S.
  Innovation widened(double sigma) const {
    Innovation wide = *this;
    wide.S.diagonal().array() += sigma * sigma;
    return wide;
  }
};

}  // namespace rio_t
