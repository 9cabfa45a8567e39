#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

/// Rotations: exponential and logarithm of SO(3) with their Jacobians.
/// Source: Forster et al., "On-Manifold Preintegration for Real-Time Visual-Inertial Odometry", TRO 2017, eq.
/// (1)-(11). Perturbations are on the right everywhere: R <- R Exp(delta).
namespace rio_t::so3 {

/// Cross-product matrix: hat(a) * b = a x b.
inline Eigen::Matrix3d hat(const Eigen::Vector3d& a) {
  Eigen::Matrix3d m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

/// Unit quaternion of the rotation vector `phi` [rad].
inline Eigen::Quaterniond exp(const Eigen::Vector3d& phi) {
  const double theta2 = phi.squaredNorm();
  const double theta = std::sqrt(theta2);
  // sin(theta/2)/theta; its series below 1e-4 rad keeps full double precision.
  const double k = theta > 1e-4 ? std::sin(0.5 * theta) / theta : 0.5 - theta2 / 48.0;
  return Eigen::Quaterniond(std::cos(0.5 * theta), k * phi.x(), k * phi.y(), k * phi.z());
}

/// Rotation vector [rad], norm at most pi, of the unit quaternion `q`.
inline Eigen::Vector3d log(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;  // the short way round
  const double w = sign * q.w();
  const Eigen::Vector3d v = sign * q.vec();
  const double n2 = v.squaredNorm();
  const double n = std::sqrt(n2);
  if (n < 1e-5) return (2.0 / w) * (1.0 - n2 / (3.0 * w * w)) * v;
  return (2.0 * std::atan2(n, w) / n) * v;
}

/// Right Jacobian: Exp(phi + d) ~ Exp(phi) Exp(Jr(phi) d).
inline Eigen::Matrix3d rightJacobian(const Eigen::Vector3d& phi) {
  const double theta2 = phi.squaredNorm();
  const Eigen::Matrix3d w = hat(phi);
  if (theta2 < 1e-8) return Eigen::Matrix3d::Identity() - 0.5 * w + (1.0 / 6.0) * w * w;
  const double theta = std::sqrt(theta2);
  return Eigen::Matrix3d::Identity() - (1.0 - std::cos(theta)) / theta2 * w +
         (theta - std::sin(theta)) / (theta2 * theta) * w * w;
}

/// Inverse of the right Jacobian: Log(Exp(phi) Exp(d)) ~ phi + Jr^-1(phi) d.
inline Eigen::Matrix3d rightJacobianInverse(const Eigen::Vector3d& phi) {
  const double theta2 = phi.squaredNorm();
  const Eigen::Matrix3d w = hat(phi);
  if (theta2 < 1e-8) return Eigen::Matrix3d::Identity() + 0.5 * w + (1.0 / 12.0) * w * w;
  const double theta = std::sqrt(theta2);
  return Eigen::Matrix3d::Identity() + 0.5 * w +
         (1.0 / theta2 - (1.0 + std::cos(theta)) / (2.0 * theta * std::sin(theta))) * w * w;
}

}  // namespace rio_t::so3
