#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "rio_t/core/time.h"

namespace rio_t {

/// What a scan says against what was predicted for it. All decisions about a scan judge this one value.
struct Innovation {
  Time stamp;
  Eigen::Vector3d d = Eigen::Vector3d::Zero();             ///< measured minus predicted velocity, in R [m/s]
  Eigen::Matrix3d S = Eigen::Matrix3d::Identity();         ///< covariance of d [m^2/s^2]
  Eigen::Matrix3d S_at_offset = Eigen::Matrix3d::Identity();  ///< the same, were the offset known
  Eigen::Vector3d J_O = Eigen::Vector3d::Zero();           ///< change of the velocity with t_O [m/s^2]

  double squaredSigmas() const { return d.dot(S.ldlt().solve(d)); }
  /// With `sigma` [m/s] more on each axis.
  Innovation widened(double sigma) const {
    Innovation wide = *this;
    wide.S.diagonal().array() += sigma * sigma;
    return wide;
  }
};

}  // namespace rio_t
