#include "rio_t/odometry/calibration_check.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "rio_t/core/so3.h"

namespace rio_t {
namespace {

/// [sigma] An innovation counts at most as this: it may be an outlier (Huber, "Robust Estimation of a
/// Location Parameter", 1964).
constexpr double kLongest = 4.0;

// The errors of a radar, by their first column.
constexpr Eigen::Index kTurn = 0, kLeverArm = 3, kScale = 6, kOffset = 7, kErrors = 8;

Eigen::Index firstOf(std::size_t radar) { return kErrors * static_cast<Eigen::Index>(radar); }

}  // namespace

double VectorError::sigmas(double tolerance) const {
  const Eigen::Matrix3d added = tolerance * tolerance * Eigen::Matrix3d::Identity();
  return std::sqrt(error.dot((covariance + added).ldlt().solve(error)));
}

double ScalarError::sigma() const { return std::sqrt(variance); }

double ScalarError::sigmas(double tolerance) const {
  return std::abs(error) / std::hypot(sigma(), tolerance);
}

// All prior sigmas are 1: a turn of a radian, beyond which nothing here is linear, a lever arm of a metre, a
// scale that is wrong by 100 %, an offset of a second.
CalibrationCheck::CalibrationCheck(std::size_t radars)
    : dv_W_(Eigen::MatrixXd::Zero(3, firstOf(radars))),
      information_(Eigen::MatrixXd::Identity(dv_W_.cols(), dv_W_.cols())),
      score_(Eigen::VectorXd::Zero(dv_W_.cols())),
      score_bias_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(radars))),
      turning_(radars) {}

void CalibrationCheck::add(std::size_t radar, const UsedInnovation& innovation) {
  // The prediction has followed the scans before.
  Eigen::MatrixXd J = -innovation.R_WR.transpose() * dv_W_;
  auto own = J.middleCols<kErrors>(firstOf(radar));
  // A radar turned by theta measures v_R + v_R x theta.
  own.middleCols<3>(kTurn) += so3::hat(innovation.v_R);
  TurningAxes& turning = turning_[radar];
  turning.add(innovation.omega_R, innovation.omega_variance);
  own.middleCols<3>(kLeverArm) += so3::hat(turning.projection() * innovation.omega_R);
  // The noise of v_R and that of the prediction v_R - d are also in d, and would look like a scale. The error
  // of their weighted mean does not depend on d if P and S are right.
  const Eigen::LDLT<Eigen::Matrix3d> S(innovation.S);
  const Eigen::Vector3d weighted_d = S.solve(innovation.d);
  const Eigen::Vector3d correction = innovation.predicted * weighted_d;
  own.col(kScale) += innovation.v_R - innovation.d + correction;
  own.col(kOffset) += innovation.J_mean;
  const Eigen::MatrixXd weighted = S.solve(J);
  const double weight = std::min(1.0, kLongest / std::sqrt(innovation.squaredSigmas()));
  information_ += weight * J.transpose() * weighted;
  score_ += weight * weighted.transpose() * innovation.d;
  score_bias_[static_cast<Eigen::Index>(radar)] +=
      weight *
      std::min(correction.dot(weighted_d), S.solve(innovation.predicted).trace());  // a fault makes d large
  dv_W_ += innovation.R_WR * innovation.predicted * weighted;
}

CalibrationErrors CalibrationCheck::errorsOf(std::size_t radar, const Extrinsics& configured) const {
  const Eigen::MatrixXd P =
      information_.ldlt().solve(Eigen::MatrixXd::Identity(score_.size(), score_.size()));
  const Eigen::VectorXd errors = P * score_;
  Eigen::MatrixXd covariance = P;
  for (std::size_t k = 0; k < turning_.size(); ++k) {
    const Eigen::VectorXd bias = score_bias_[static_cast<Eigen::Index>(k)] * P.col(firstOf(k) + kScale);
    covariance += bias * bias.transpose();
  }

  const Eigen::Matrix3d R_IR = configured.q_IR.toRotationMatrix();
  const auto vector = [&](Eigen::Index at) {
    at += firstOf(radar);
    return VectorError{R_IR * errors.segment<3>(at),
                       R_IR * covariance.block<3, 3>(at, at) * R_IR.transpose()};
  };
  const auto scalar = [&](Eigen::Index at) {
    at += firstOf(radar);
    return ScalarError{errors[at], covariance(at, at)};
  };
  return {vector(kTurn), vector(kLeverArm), scalar(kScale), scalar(kOffset)};
}

}  // namespace rio_t
