#include "rio_t/smoother/node_prior.h"

#include <cmath>

#include "rio_t/core/so3.h"

namespace rio_t {

Eigen::VectorXd extrinsicsSigmas(const SmootherOptions& options, const CalibrationPrior& radar) {
  Eigen::Matrix<double, 6, 1> sigmas;
  sigmas << Eigen::Vector3d::Constant(options.extrinsics_rotation_sigma),
      Eigen::Vector3d::Constant(radar.extrinsics_translation_sigma);
  return estimatedPart(sigmas, options.estimate_extrinsics);
}

Eigen::VectorXd calibrationSigmas(const SmootherOptions& options, const CalibrationPrior& radar) {
  const Eigen::VectorXd extrinsics = extrinsicsSigmas(options, radar);
  Eigen::VectorXd sigmas(1 + extrinsics.size());
  sigmas << radar.time_offset_sigma, extrinsics;
  return sigmas;
}

NodePrior priorAtRest(const SmootherOptions& options, const ImuNoise& noise, const StateBlock& x,
                      double gravity, double duration, const CalibrationPrior& radar) {
  using S = StateBlock;
  const Eigen::VectorXd calibration = calibrationSigmas(options, radar);
  const Eigen::Index size = S::kTangent + calibration.size();
  SquareRoot known{Eigen::MatrixXd(0, size), {}};
  const auto add = [&](const Eigen::MatrixXd& rows, Eigen::Index first, double sigma) {
    known.J.conservativeResize(known.J.rows() + rows.rows(), Eigen::NoChange);
    known.J.bottomRows(rows.rows()).setZero();
    known.J.block(known.J.rows() - rows.rows(), first, rows.rows(), rows.cols()) = rows / sigma;
  };
  const auto addVector = [&](int first, double sigma) { add(Eigen::Matrix3d::Identity(), first, sigma); };

  // Theta is in I, yaw is about the vertical of W.
  const Eigen::Matrix3d R_WI = x.q_WI().toRotationMatrix();
  add(R_WI.row(2), S::kTheta, options.prior_sigma_yaw);
  addVector(S::kP, options.prior_sigma_position);
  addVector(S::kV, options.prior_sigma_velocity);
  // A mean over T seconds leaves density / sqrt(T). The gyro bias also has its own instability.
  const double root_T = std::sqrt(duration);
  addVector(S::kBg, std::hypot(options.prior_sigma_gyro_bias, noise.gyro_density / root_T));
  addVector(S::kBa, options.prior_sigma_accel_bias);
  for (Eigen::Index k = 0; k < calibration.size(); ++k)
    add(Eigen::MatrixXd::Identity(1, 1), S::kTangent + k, calibration[k]);

  // The mean of the accelerometer measures R_IW (0, 0, g) + b_a. The platform may have gained some velocity.
  const double gained = std::sqrt(2.0) * options.prior_sigma_velocity / duration;
  const double sigma = std::hypot(noise.accel_density / root_T, gained);
  Eigen::Matrix<double, 3, S::kTangent> J = Eigen::Matrix<double, 3, S::kTangent>::Zero();
  J.middleCols<3>(S::kTheta) = so3::hat(gravity * R_WI.row(2).transpose());
  J.middleCols<3>(S::kBa).setIdentity();
  add(J, 0, sigma);
  known.r0.setZero(known.J.rows());
  return {x, radar.time_offset_initial, radar.T_IR, widened(known, Eigen::VectorXd::Zero(size))};
}

}  // namespace rio_t
