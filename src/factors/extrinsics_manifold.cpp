#include "rio_t/factors/extrinsics_manifold.h"

#include "rio_t/core/so3.h"

namespace rio_t {
namespace {

std::vector<int> freeColumns(EstimateExtrinsics estimate) {
  if (estimate == EstimateExtrinsics::kRotation) return {0, 1, 2};
  return {0, 1, 2, 4, 5, 6};
}

}  // namespace

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
    : Manifold(ExtrinsicsBlock::kSize, freeColumns(estimate)) {}

void ExtrinsicsManifold::plus(const double* x, const double* delta, double* x_plus_delta) const {
  const Extrinsics before = toExtrinsics(x);
  const Eigen::Vector3d turn = Eigen::Map<const Eigen::Vector3d>(delta);
  Eigen::Vector3d l_I = before.l_I;
  if (tangent() > 3) l_I += Eigen::Map<const Eigen::Vector3d>(delta + 3);
  Eigen::Map<Eigen::Quaterniond>{x_plus_delta} = (so3::exp(turn) * before.q_IR).normalized();
  Eigen::Map<Eigen::Vector3d>{x_plus_delta + ExtrinsicsBlock::kLever} = l_I;
}

Eigen::VectorXd ExtrinsicsManifold::minus(const double* y, const double* x) const {
  const Extrinsics from = toExtrinsics(x);
  const Extrinsics to = toExtrinsics(y);
  Eigen::VectorXd delta(tangent());
  delta.head<3>() = turnBetween(from, to);
  if (tangent() > 3) delta.tail<3>() = to.l_I - from.l_I;
  return delta;
}

Eigen::MatrixXd ExtrinsicsManifold::minusJacobian(const double* y, const double* x) const {
  Eigen::MatrixXd J = Eigen::MatrixXd::Identity(tangent(), tangent());
  // Exp(d) on the left is Exp(-d) on the right of the inverse.
  J.topLeftCorner<3, 3>() = so3::rightJacobianInverse(-minus(y, x).head<3>());
  return J;
}

Eigen::Matrix<double, 6, 6> extrinsicsCovariance(const Eigen::MatrixXd& tangent) {
  Eigen::Matrix<double, 6, 6> result = Eigen::Matrix<double, 6, 6>::Zero();
  if (tangent.rows() == 0) return result;
  result.bottomRightCorner<3, 3>() = tangent.topLeftCorner<3, 3>();
  if (tangent.rows() == 3) return result;
  result.topLeftCorner<3, 3>() = tangent.bottomRightCorner<3, 3>();
  result.bottomLeftCorner<3, 3>() = tangent.topRightCorner<3, 3>();
  result.topRightCorner<3, 3>() = tangent.bottomLeftCorner<3, 3>();
  return result;
}

Eigen::MatrixXd tangentCovariance(const Eigen::Matrix<double, 6, 6>& ros, EstimateExtrinsics estimate) {
  if (estimate == EstimateExtrinsics::kNone) return {};
  if (estimate == EstimateExtrinsics::kRotation) return ros.bottomRightCorner<3, 3>();
  return extrinsicsCovariance(ros);  // swaps the halves
}

}  // namespace rio_t
