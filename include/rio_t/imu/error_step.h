#pragma once

#include <Eigen/Geometry>

#include "rio_t/core/so3.h"

namespace rio_t {

/// Sums the samples of kCovarianceStep. The covariance takes one step for them: platforms hardly turn in it.
struct SampleSum {
  static constexpr double kCovarianceStep = 0.01;  // [s]

  double dt = 0.0;                                        ///< [s]
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();  ///< attitude of I before them
  Eigen::Vector3d angle = Eigen::Vector3d::Zero();        ///< integral of the angular rate, in I [rad]
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();     ///< integral of the specific force, in I [m/s]
  double gyro_variance = 0.0;                             ///< of `angle`, per axis [rad^2]
  double accel_variance = 0.0;                            ///< of `velocity`, per axis [m^2/s^2]
  double position_variance = 0.0;                         ///< besides that by the velocity, per axis [m^2]

  /// `now` is the attitude before the sample; rates without biases; squared densities of their noise.
  void add(const Eigen::Quaterniond& now, double step, const Eigen::Vector3d& omega, const Eigen::Vector3d& a,
           double gyro_density, double accel_density, double velocity_density) {
    if (dt == 0.0) q = now;
    dt += step;
    angle += step * omega;
    velocity += step * a;
    gyro_variance += step * gyro_density;
    accel_variance += step * accel_density;
    position_variance += step * velocity_density;
  }
  bool isWhole() const { return dt >= kCovarianceStep; }
};

/// Propagates the errors of orientation (right perturbation), position, velocity and, if P has them, of the
/// biases over one IMU step with midpoint rotation: P <- A P A', where A is the identity but for
///   theta <- A_tt theta - dt b_g,   v <- v + A_vt theta - dt R b_a,   p <- p + A_vt theta dt / 2 + v dt
/// (docs/method.md, section 4; Forster et al., eq. 59-63). The order is theta, p, v[, b_g, b_a].
///
/// Written out by blocks of three because a dense A P A' of this size costs ten times as much, at IMU rate.
struct ErrorStep {
  double dt;
  Eigen::Matrix3d A_tt;  ///< Exp(-omega dt)
  Eigen::Matrix3d A_vt;  ///< -dt R hat(a) Exp(-omega dt / 2)
  Eigen::Matrix3d R;     ///< at the middle of the step

  explicit ErrorStep(const SampleSum& samples) : dt(samples.dt) {
    const Eigen::Quaterniond half = so3::exp(0.5 * samples.angle);
    const Eigen::Matrix3d half_T = half.toRotationMatrix().transpose();
    A_tt = half_T * half_T;
    R = (samples.q * half).toRotationMatrix();
    A_vt = -R * so3::hat(samples.velocity) * half_T;
  }

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

/// Propagates the covariance P of ErrorStep over `samples`, adds the noise of the IMU and clears `samples`.
/// The caller adds the random walk of the biases.
template <int Size>
void propagateCovariance(SampleSum& samples, Eigen::Matrix<double, Size, Size>& P) {
  if (samples.dt == 0.0) return;
  constexpr int kTheta = 0, kP = 3, kV = 6;
  ErrorStep(samples).propagate(P);
  const auto add = [&P](int row, int column, double variance) {
    P.template block<3, 3>(row, column).diagonal().array() += variance;
  };
  add(kTheta, kTheta, samples.gyro_variance);
  // White noise of the acceleration: the errors of position and velocity correlate (double integration).
  add(kP, kP, samples.accel_variance * samples.dt * samples.dt / 3.0 + samples.position_variance);
  add(kP, kV, samples.accel_variance * samples.dt / 2.0);
  add(kV, kP, samples.accel_variance * samples.dt / 2.0);
  add(kV, kV, samples.accel_variance);
  samples = {};
}

}  // namespace rio_t
