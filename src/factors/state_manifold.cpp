#include "rio_t/factors/state_manifold.h"

namespace rio_t {
namespace {

constexpr int kSize = StateBlock::kSize;
constexpr int kTangent = StateBlock::kTangent;

/// Selects the columns of `StateJacobian` that carry tangent derivatives: all but the fourth.
bool selection(double* jacobian) {
  Eigen::Map<Eigen::Matrix<double, kSize, kTangent, Eigen::RowMajor>> J(jacobian);
  J.setZero();
  J.topLeftCorner<3, 3>().setIdentity();
  J.bottomRightCorner<kTangent - 3, kTangent - 3>().setIdentity();
  return true;
}

}  // namespace

bool StateManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  boxplus(x, delta, x_plus_delta);
  return true;
}

#if RIO_T_CERES_HAS_MANIFOLD
bool StateManifold::PlusJacobian(const double*, double* jacobian) const { return selection(jacobian); }

bool StateManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  Eigen::Map<StateTangent>{y_minus_x} = boxminus(y, x);
  return true;
}

bool StateManifold::MinusJacobian(const double*, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, kTangent, kSize, Eigen::RowMajor>> J(jacobian);
  J.setZero();
  J.topLeftCorner<3, 3>().setIdentity();
  J.bottomRightCorner<kTangent - 3, kTangent - 3>().setIdentity();
  return true;
}
#else
bool StateManifold::ComputeJacobian(const double*, double* jacobian) const { return selection(jacobian); }
#endif

void addStateBlock(ceres::Problem& problem, double* block, StateManifold& manifold) {
  problem.AddParameterBlock(block, kSize, &manifold);
}

}  // namespace rio_t
