#pragma once

#include <Eigen/Core>

#include "rio_t/core/so3.h"

namespace rio_t {

/// How the errors of orientation (right perturbation), position and velocity, and of the biases where they
/// are among the columns, go over one IMU step with midpoint rotation: P <- A P A', A the identity but for
///   theta <- A_tt theta - dt b_g,   v <- v + A_vt theta - dt R b_a,   p <- p + A_vt theta dt / 2 + v dt
/// (docs/method.md, section 4; Forster et al., eq. 59-63). The order is theta, p, v[, b_g, b_a].
///
/// Written out by blocks of three because a dense A P A' of this size costs ten times as much, at IMU rate.
struct ErrorStep {
  double dt;
  Eigen::Matrix3d A_tt;  ///< Exp(-omega dt)
  Eigen::Matrix3d A_vt;  ///< -dt R hat(a) Exp(-omega dt / 2)
  Eigen::Matrix3d R;     ///< at the middle of the step

  ErrorStep(double dt_in, const Eigen::Matrix3d& half_T, const Eigen::Matrix3d& R_mid,
            const Eigen::Vector3d& a)
      : dt(dt_in), A_tt(half_T * half_T), A_vt(-dt_in * R_mid * so3::hat(a) * half_T), R(R_mid) {}

  template <int Size>
  void propagate(Eigen::Matrix<double, Size, Size>& P) const {
    const Eigen::Matrix<double, Size, Size> AP = timesTransposed(P).transpose();
    P = timesTransposed(AP);
  }

 private:
  /// P A'
  template <int Size>
  Eigen::Matrix<double, Size, Size> timesTransposed(const Eigen::Matrix<double, Size, Size>& P) const {
    Eigen::Matrix<double, Size, Size> result = P;
    const auto theta = P.template leftCols<3>();
    const Eigen::Matrix<double, Size, 3> dv = theta.lazyProduct(A_vt.transpose());
    result.template leftCols<3>() = theta.lazyProduct(A_tt.transpose());
    result.template middleCols<3>(3) += 0.5 * dt * dv + dt * P.template middleCols<3>(6);
    result.template middleCols<3>(6) += dv;
    if constexpr (Size == 15) {
      result.template leftCols<3>() -= dt * P.template middleCols<3>(9);
      result.template middleCols<3>(6) -= dt * P.template rightCols<3>().lazyProduct(R.transpose());
    }
    return result;
  }
};

}  // namespace rio_t
