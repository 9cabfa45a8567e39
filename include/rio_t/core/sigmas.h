#pragma once

#include <Eigen/Core>

namespace rio_t {

/// Standard deviations of a covariance; zero for a variance that rounding has made negative.
template <typename Covariance>
Eigen::Matrix<double, Covariance::RowsAtCompileTime, 1> sigmasOf(const Covariance& covariance) {
  return covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
}

}  // namespace rio_t
