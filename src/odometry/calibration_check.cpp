#include "rio_t/odometry/calibration_check.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "rio_t/core/so3.h"

namespace rio_t {
namespace {

/// An innovation counts at most as so many sigma (Huber, "Robust Estimation of a Location Parameter", 1964):
/// it may be an outlier.
constexpr double kLongest = 4.0;

constexpr int kTurn = 3;

}  // namespace

// The prior: a turn of a radian, beyond which nothing here is linear, a scale that is off by itself, an
// offset of a second.
CalibrationCheck::CalibrationCheck(std::size_t radars, bool holds_offsets)
    : holds_offsets_(holds_offsets),
      each_(kTurn + (holds_offsets ? 2 : 1)),
      dv_W_(Eigen::MatrixXd::Zero(3, each_ * static_cast<Eigen::Index>(radars))),
      information_(Eigen::MatrixXd::Identity(dv_W_.cols(), dv_W_.cols())),
      score_(Eigen::VectorXd::Zero(dv_W_.cols())),
      alike_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(radars))) {}

void CalibrationCheck::add(std::size_t radar, const UsedInnovation& innovation) {
  // A radar turned by theta measures v_R + v_R x theta. The prediction has followed the scans before.
  Eigen::MatrixXd J = -innovation.R_WR.transpose() * dv_W_;
  J.middleCols<kTurn>(turnAt(radar)) += so3::hat(innovation.v_R);
  // The noise of v_R and that of the prediction are also in d, and would look like a scale. The error of
  // their mean, weighted as the window weighs them, does not depend on d if P and S are right.
  const Eigen::LDLT<Eigen::Matrix3d> S(innovation.S);
  const Eigen::Vector3d weighted_d = S.solve(innovation.d);
  const Eigen::Vector3d correction = innovation.predicted * weighted_d;
  J.col(scaleAt(radar)) += innovation.v_R - innovation.d + correction;
  if (holds_offsets_) J.col(offsetAt(radar)) += innovation.J_mean;
  const Eigen::MatrixXd weighted = S.solve(J);
  const double weight = std::min(1.0, kLongest / std::sqrt(innovation.squaredSigmas()));
  information_ += weight * J.transpose() * weighted;
  score_ += weight * weighted.transpose() * innovation.d;
  alike_[static_cast<Eigen::Index>(radar)] +=
      weight *
      std::min(correction.dot(weighted_d), S.solve(innovation.predicted).trace());  // a fault makes d large
  dv_W_ += innovation.R_WR * innovation.predicted * weighted;
}

CalibrationErrors CalibrationCheck::errorsOf(std::size_t radar, const Extrinsics& configured) const {
  const Eigen::MatrixXd P =
      information_.ldlt().solve(Eigen::MatrixXd::Identity(score_.size(), score_.size()));
  const Eigen::VectorXd errors = P * score_;
  Eigen::MatrixXd covariance = P;
  for (Eigen::Index k = 0; k < alike_.size(); ++k) {
    const Eigen::VectorXd bias = alike_[k] * P.col(scaleAt(static_cast<std::size_t>(k)));
    covariance += bias * bias.transpose();
  }

  const Eigen::Index turn = turnAt(radar), scale = scaleAt(radar), offset = offsetAt(radar);
  const Eigen::Matrix3d R_IR = configured.q_IR.toRotationMatrix();
  CalibrationErrors result;
  result.turn.turn = R_IR * errors.segment<kTurn>(turn);
  result.turn.covariance = R_IR * covariance.block<kTurn, kTurn>(turn, turn) * R_IR.transpose();
  result.scale = {errors[scale], covariance(scale, scale)};
  if (holds_offsets_) result.offset = TimeOffsetError{errors[offset], covariance(offset, offset)};
  return result;
}

}  // namespace rio_t
