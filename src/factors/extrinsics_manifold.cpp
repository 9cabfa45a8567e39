#include "rio_t/factors/extrinsics_manifold.h"

#include "rio_t/core/so3.h"

namespace rio_t {
namespace {

std::vector<int> freeColumns(EstimateExtrinsics estimate) {
  if (estimate == EstimateExtrinsics::kLeverArm) return {4, 5, 6};
  if (estimate == EstimateExtrinsics::kRotation) return {0, 1, 2};
  return {0, 1, 2, 4, 5, 6};
}

}  // namespace

bool estimatesTurn(EstimateExtrinsics estimate) {
  return estimate == EstimateExtrinsics::kRotation || estimate == EstimateExtrinsics::kPose;
}

bool estimatesLeverArm(EstimateExtrinsics estimate) {
  return estimate == EstimateExtrinsics::kLeverArm || estimate == EstimateExtrinsics::kPose;
}

Eigen::VectorXd estimatedPart(const Eigen::Matrix<double, 6, 1>& of_pose, EstimateExtrinsics estimate) {
  const Eigen::Index first = estimatesTurn(estimate) ? 0 : 3;
  return of_pose.segment(first, (estimatesLeverArm(estimate) ? 6 : 3) - first);
}

Extrinsics toExtrinsics(const double* stored) {
  return {Eigen::Map<const Eigen::Vector3d>(stored + ExtrinsicsBlock::kLever),
          Eigen::Map<const Eigen::Quaterniond>(stored)};
}

Eigen::VectorXd stored(const Extrinsics& T_IR) {
  Eigen::VectorXd x(ExtrinsicsBlock::kSize);
  x << T_IR.q_IR.coeffs(), T_IR.l_I;
  return x;
}

ExtrinsicsManifold::ExtrinsicsManifold(EstimateExtrinsics estimate)
    : Manifold(ExtrinsicsBlock::kSize, freeColumns(estimate)),
      has_turn_(estimate != EstimateExtrinsics::kLeverArm),
      has_lever_arm_(estimate != EstimateExtrinsics::kRotation) {}

void ExtrinsicsManifold::plus(const double* x, const double* delta, double* x_plus_delta) const {
  const Extrinsics before = toExtrinsics(x);
  Eigen::Quaterniond q_IR = before.q_IR;
  Eigen::Vector3d l_I = before.l_I;
  if (has_turn_) q_IR = (so3::exp(Eigen::Map<const Eigen::Vector3d>(delta)) * before.q_IR).normalized();
  if (has_lever_arm_) l_I += Eigen::Map<const Eigen::Vector3d>(delta + tangent() - 3);
  Eigen::Map<Eigen::Quaterniond>{x_plus_delta} = q_IR;
  Eigen::Map<Eigen::Vector3d>{x_plus_delta + ExtrinsicsBlock::kLever} = l_I;
}

Eigen::VectorXd ExtrinsicsManifold::minus(const double* y, const double* x) const {
  const Extrinsics from = toExtrinsics(x);
  const Extrinsics to = toExtrinsics(y);
  Eigen::VectorXd delta(tangent());
  if (has_turn_) delta.head<3>() = turnBetween(from, to);
  if (has_lever_arm_) delta.tail<3>() = to.l_I - from.l_I;
  return delta;
}

Eigen::MatrixXd ExtrinsicsManifold::minusJacobian(const double* y, const double* x) const {
  Eigen::MatrixXd J = Eigen::MatrixXd::Identity(tangent(), tangent());
  // Exp(d) on the left is Exp(-d) on the right of the inverse.
  if (has_turn_) J.topLeftCorner<3, 3>() = so3::rightJacobianInverse(-minus(y, x).head<3>());
  return J;
}

Eigen::Matrix<double, 6, 6> extrinsicsCovariance(const Eigen::MatrixXd& tangent,
                                                 EstimateExtrinsics estimate) {
  Eigen::Matrix<double, 6, 6> result = Eigen::Matrix<double, 6, 6>::Zero();
  if (estimatesTurn(estimate)) result.bottomRightCorner<3, 3>() = tangent.topLeftCorner<3, 3>();
  if (estimatesLeverArm(estimate)) result.topLeftCorner<3, 3>() = tangent.bottomRightCorner<3, 3>();
  if (estimate != EstimateExtrinsics::kPose) return result;
  result.bottomLeftCorner<3, 3>() = tangent.topRightCorner<3, 3>();
  result.topRightCorner<3, 3>() = tangent.bottomLeftCorner<3, 3>();
  return result;
}

Eigen::MatrixXd tangentCovariance(const Eigen::Matrix<double, 6, 6>& ros, EstimateExtrinsics estimate) {
  if (estimate == EstimateExtrinsics::kNone) return {};
  if (estimate == EstimateExtrinsics::kLeverArm) return ros.topLeftCorner<3, 3>();
  if (estimate == EstimateExtrinsics::kRotation) return ros.bottomRightCorner<3, 3>();
  return extrinsicsCovariance(ros, estimate);  // swaps the halves
}

}  // namespace rio_t
