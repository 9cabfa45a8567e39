#include "rio_t/factors/landmark_factor.h"

#include <cmath>

#include "rio_t/core/so3.h"

namespace rio_t {

PolarNoise::PolarNoise(const PolarMeasurement& z) : range_(z.position_R.norm()) {
  const Eigen::Vector3d u = z.position_R / range_;
  const double level = std::hypot(u.x(), u.y());
  // Azimuth from y to x, as everywhere in R. Straight up it has no meaning; callers leave such points out.
  const double s = u.x() / level, c = u.y() / level;
  axes_.row(0) = u;
  axes_.row(1) << c, -s, 0.0;
  axes_.row(2) << -u.z() * s, -u.z() * c, level;
  sigmas_ << z.range_sigma, level * z.azimuth_sigma, z.elevation_sigma;
}

PolarResidual PolarNoise::at(const Eigen::Vector3d& predicted_R) const {
  const double range = predicted_R.norm();
  const Eigen::Vector3d u = predicted_R / range;
  const Eigen::Matrix3d across = (Eigen::Matrix3d::Identity() - u * u.transpose()) / range;
  PolarResidual result;
  result.value << range - range_, axes_.row(1).dot(u), axes_.row(2).dot(u);
  result.J << u.transpose(), axes_.row(1) * across, axes_.row(2) * across;
  result.value.array() /= sigmas_.array();
  result.J = (sigmas_.cwiseInverse().asDiagonal() * result.J).eval();
  return result;
}

Eigen::Matrix3d PolarNoise::covariance() const {
  const Eigen::Vector3d metres(sigmas_[0], range_ * sigmas_[1], range_ * sigmas_[2]);
  return axes_.transpose() * metres.cwiseAbs2().asDiagonal() * axes_;
}

SeenPoint seenFrom(const MotionView& x, const ImuDelta& delta, const Eigen::Vector3d& g_W,
                   const Extrinsics& T_IR, const Eigen::Vector3d& p_W) {
  const double T = delta.dt;
  const Eigen::Matrix3d R_IW = x.q_WI.toRotationMatrix().transpose();  // at the state
  const Eigen::Matrix3d dR_T = delta.dR.toRotationMatrix().transpose();
  const Eigen::Matrix3d R_RI = T_IR.R_RI();
  const Eigen::Vector3d from_state = R_IW * (p_W - x.p_W - T * x.v_W - 0.5 * T * T * g_W);
  const Eigen::Vector3d from_radar = dR_T * (from_state - delta.dp) - T_IR.l_I;  // in I, when measured
  const Eigen::Matrix3d R_R_state = R_RI * dR_T;
  const Eigen::Matrix3d R_RW = R_R_state * R_IW;

  SeenPoint seen;
  seen.p_R = R_RI * from_radar;
  seen.J_motion.setZero();
  seen.J_motion.middleCols<3>(StateBlock::kQStored) = R_R_state * so3::hat(from_state);
  seen.J_motion.middleCols<3>(StateBlock::kPStored) = -R_RW;
  seen.J_motion.middleCols<3>(StateBlock::kVStored) = -T * R_RW;
  seen.J_extrinsics.setZero();
  seen.J_extrinsics.leftCols<3>() = R_RI * so3::hat(from_radar);
  seen.J_extrinsics.rightCols<3>() = -R_RI;
  seen.J_point = R_RW;
  return seen;
}

bool LandmarkFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const SeenPoint seen = seenFrom(MotionView(parameters[0]), delta_, g_W_, toExtrinsics(parameters[1]),
                                  Eigen::Map<const Eigen::Vector3d>(parameters[2]));
  const PolarResidual residual = noise_.at(seen.p_R);
  Eigen::Map<Eigen::Vector3d>{residuals} = residual.value;
  if (jacobians == nullptr) return true;
  store(residual.J * seen.J_motion, jacobians[0]);
  store(residual.J * seen.J_extrinsics, jacobians[1]);
  store(residual.J * seen.J_point, jacobians[2]);
  return true;
}

}  // namespace rio_t
