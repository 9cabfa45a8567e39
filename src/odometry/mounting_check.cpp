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

}  // namespace

// The prior: a turn of a radian. Beyond it, nothing here is linear.
MountingCheck::MountingCheck(std::size_t radars)
    : dv_W_(Eigen::MatrixXd::Zero(3, 3 * static_cast<Eigen::Index>(radars))),
      information_(Eigen::MatrixXd::Identity(dv_W_.cols(), dv_W_.cols())),
      score_(Eigen::VectorXd::Zero(dv_W_.cols())) {}

void MountingCheck::add(std::size_t radar, const UsedInnovation& innovation) {
  // A radar turned by theta measures v_R + v_R x theta. The prediction has followed the scans before.
  Eigen::MatrixXd J = -innovation.R_WR.transpose() * dv_W_;
  J.middleCols<3>(3 * static_cast<Eigen::Index>(radar)) += so3::hat(innovation.v_R);
  const Eigen::LDLT<Eigen::Matrix3d> S(innovation.S);
  const Eigen::MatrixXd weighted = S.solve(J);
  const double weight = std::min(1.0, kLongest / std::sqrt(innovation.squaredSigmas()));
  information_ += weight * J.transpose() * weighted;
  score_ += weight * weighted.transpose() * innovation.d;
  dv_W_ += innovation.R_WR * innovation.predicted * weighted;
}

MountingTurn MountingCheck::turnOf(std::size_t radar, const Extrinsics& configured) const {
  const Eigen::Index first = 3 * static_cast<Eigen::Index>(radar);
  const Eigen::MatrixXd covariance =
      information_.ldlt().solve(Eigen::MatrixXd::Identity(score_.size(), score_.size()));
  const Eigen::Matrix3d R_IR = configured.q_IR.toRotationMatrix();
  return {R_IR * (covariance.middleRows<3>(first) * score_),
          R_IR * covariance.block<3, 3>(first, first) * R_IR.transpose()};
}

}  // namespace rio_t
