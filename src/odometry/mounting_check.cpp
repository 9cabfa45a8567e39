#include "rio_t/odometry/mounting_check.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "rio_t/core/so3.h"

namespace rio_t {
namespace {

/// An innovation counts at most as so many sigma (Huber, "Robust Estimation of a Location Parameter", 1964):
/// it may be an outlier.
constexpr double kLongest = 4.0;

// The errors of a radar: its turn, then its scale.
constexpr int kTurn = 3, kErrors = kTurn + 1;
Eigen::Index turnAt(std::size_t radar) { return kErrors * static_cast<Eigen::Index>(radar); }
Eigen::Index scaleAt(std::size_t radar) { return turnAt(radar) + kTurn; }

}  // namespace

// The prior: a turn of a radian, beyond which nothing here is linear, and a scale that is off by itself.
MountingCheck::MountingCheck(std::size_t radars)
    : dv_W_(Eigen::MatrixXd::Zero(3, kErrors * static_cast<Eigen::Index>(radars))),
      information_(Eigen::MatrixXd::Identity(dv_W_.cols(), dv_W_.cols())),
      score_(Eigen::VectorXd::Zero(dv_W_.cols())),
      alike_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(radars))) {}

void MountingCheck::add(std::size_t radar, const UsedInnovation& innovation) {
  // A radar turned by theta measures v_R + v_R x theta. The prediction has followed the scans before.
  Eigen::MatrixXd J = -innovation.R_WR.transpose() * dv_W_;
  J.middleCols<kTurn>(turnAt(radar)) += so3::hat(innovation.v_R);
  // The noise of v_R and that of the prediction are also in d, and would look like a scale. The error of
  // their mean, weighted as the window weighs them, does not depend on d if P and S are right.
  const Eigen::LDLT<Eigen::Matrix3d> S(innovation.S);
  const Eigen::Vector3d weighted_d = S.solve(innovation.d);
  const Eigen::Vector3d correction = innovation.predicted * weighted_d;
  J.col(scaleAt(radar)) += innovation.v_R - innovation.d + correction;
  const Eigen::MatrixXd weighted = S.solve(J);
  const double weight = std::min(1.0, kLongest / std::sqrt(innovation.squaredSigmas()));
  information_ += weight * J.transpose() * weighted;
  score_ += weight * weighted.transpose() * innovation.d;
  alike_[static_cast<Eigen::Index>(radar)] +=
      weight *
      std::min(correction.dot(weighted_d), S.solve(innovation.predicted).trace());  // a fault makes d large
  dv_W_ += innovation.R_WR * innovation.predicted * weighted;
}

Eigen::MatrixXd MountingCheck::covariance() const {
  return information_.ldlt().solve(Eigen::MatrixXd::Identity(score_.size(), score_.size()));
}

MountingTurn MountingCheck::turnOf(std::size_t radar, const Extrinsics& configured) const {
  const Eigen::Index first = turnAt(radar);
  const Eigen::MatrixXd P = covariance();
  const Eigen::Matrix3d R_IR = configured.q_IR.toRotationMatrix();
  return {R_IR * (P.middleRows<kTurn>(first) * score_),
          R_IR * P.block<kTurn, kTurn>(first, first) * R_IR.transpose()};
}

DopplerScale MountingCheck::scaleOf(std::size_t radar) const {
  const Eigen::Index k = scaleAt(radar);
  const Eigen::MatrixXd P = covariance();
  const double bias = P(k, k) * alike_[static_cast<Eigen::Index>(radar)];
  return {P.row(k) * score_, P(k, k) + bias * bias};
}

}  // namespace rio_t
