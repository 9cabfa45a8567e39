#pragma once

#include <Eigen/Core>

#include "rio_t/graph/manifold.h"
#include "rio_t/radar/extrinsics.h"

namespace rio_t {

/// Which part of a mounting is estimated.
enum class EstimateExtrinsics {
  kNone,      ///< "none": the mounting is as configured
  kRotation,  ///< "rotation"
  kPose,      ///< "pose": rotation and lever arm
};

/// Extrinsics as a block: q_IR as x, y, z, w, then l_I.
struct ExtrinsicsBlock {
  static constexpr int kSize = 7;
  static constexpr int kLever = 4;  ///< first number of l_I
};
/// By rows, as Ceres writes it, for the block as stored. The first three columns are the turn.
template <int Rows>
using ExtrinsicsJacobian = Eigen::Matrix<double, Rows, ExtrinsicsBlock::kSize, Eigen::RowMajor>;

Extrinsics toExtrinsics(const double* stored);
Eigen::VectorXd stored(const Extrinsics& T_IR);

/// Extrinsics as a Manifold. The tangent is a turn about the axes of I [rad] and, if the lever arm is
/// estimated, the change of l_I [m]: q_IR <- Exp(turn) q_IR. So a covariance is in I, as in ROS messages.
class ExtrinsicsManifold final : public Manifold {
 public:
  /// With kNone the block has to be constant; it still has the tangent of a pose.
  explicit ExtrinsicsManifold(EstimateExtrinsics estimate);
  void plus(const double* x, const double* delta, double* x_plus_delta) const override;
  Eigen::VectorXd minus(const double* y, const double* x) const override;
  Eigen::MatrixXd minusJacobian(const double* y, const double* x) const override;
};

/// Covariance in the order of ROS, translation [m^2] then turn [rad^2], of that of the tangent; zero where
/// nothing is estimated and `tangent` is empty.
Eigen::Matrix<double, 6, 6> extrinsicsCovariance(const Eigen::MatrixXd& tangent);
/// The way back: empty for kNone.
Eigen::MatrixXd tangentCovariance(const Eigen::Matrix<double, 6, 6>& ros, EstimateExtrinsics estimate);

}  // namespace rio_t
