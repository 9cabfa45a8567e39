#pragma once

#include <Eigen/Core>

#include "rio_t/graph/manifold.h"
#include "rio_t/radar/extrinsics.h"

namespace rio_t {

/// Which part of a mounting is estimated.
enum class EstimateExtrinsics {
  kNone,      ///< "none": the mounting is as configured
  kLeverArm,  ///< "none", but nobody has measured the lever arm
  kRotation,  ///< "rotation"
  kPose,      ///< "pose": rotation and lever arm
};
bool estimatesTurn(EstimateExtrinsics estimate);
bool estimatesLeverArm(EstimateExtrinsics estimate);
/// The estimated part of the six numbers of a pose: turn, then lever arm.
Eigen::VectorXd estimatedPart(const Eigen::Matrix<double, 6, 1>& of_pose, EstimateExtrinsics estimate);

/// Extrinsics as a block: q_IR as x, y, z, w, then l_I.
struct ExtrinsicsBlock {
  static constexpr int kSize = 7;
  static constexpr int kLever = 4;  ///< first number of l_I
};
/// Derivative with respect to the stored block, row-major as in Ceres. The first three columns are the turn.
template <int Rows>
using ExtrinsicsJacobian = Eigen::Matrix<double, Rows, ExtrinsicsBlock::kSize, Eigen::RowMajor>;

Extrinsics toExtrinsics(const double* stored);
Eigen::VectorXd stored(const Extrinsics& T_IR);

/// Extrinsics as a Manifold. The tangent is a turn about the axes of I [rad], q_IR <- Exp(turn) q_IR, then
/// the change of l_I [m]; only the estimated part of these. So a covariance is in I, as in ROS messages.
class ExtrinsicsManifold final : public Manifold {
 public:
  /// With kNone the block has to be constant; it still has the tangent of a pose.
  explicit ExtrinsicsManifold(EstimateExtrinsics estimate);
  void plus(const double* x, const double* delta, double* x_plus_delta) const override;
  Eigen::VectorXd minus(const double* y, const double* x) const override;
  Eigen::MatrixXd minusJacobian(const double* y, const double* x) const override;

 private:
  bool has_turn_, has_lever_arm_;
};

/// Converts the covariance of the tangent to the order of ROS: translation [m^2], then turn [rad^2]. What is
/// not estimated is zero. `tangent` is empty for kNone.
Eigen::Matrix<double, 6, 6> extrinsicsCovariance(const Eigen::MatrixXd& tangent, EstimateExtrinsics estimate);
/// The inverse of extrinsicsCovariance; empty for kNone.
Eigen::MatrixXd tangentCovariance(const Eigen::Matrix<double, 6, 6>& ros, EstimateExtrinsics estimate);

}  // namespace rio_t
