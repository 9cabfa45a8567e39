#pragma once

#include <ceres/problem.h>
#include <ceres/version.h>

#include "rio_t/factors/state_block.h"

/// The one place that knows which Ceres is there: manifolds since 2.1, local parameterizations before
/// (Noetic: 1.14).
#define RIO_T_CERES_HAS_MANIFOLD \
  (CERES_VERSION_MAJOR > 2 || (CERES_VERSION_MAJOR == 2 && CERES_VERSION_MINOR >= 1))

#if RIO_T_CERES_HAS_MANIFOLD
#include <ceres/manifold.h>
#else
#include <ceres/local_parameterization.h>
#endif

namespace rio_t {

#if RIO_T_CERES_HAS_MANIFOLD
class StateManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return StateBlock::kSize; }
  int TangentSize() const override { return StateBlock::kTangent; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};
#else
class StateManifold final : public ceres::LocalParameterization {
 public:
  int GlobalSize() const override { return StateBlock::kSize; }
  int LocalSize() const override { return StateBlock::kTangent; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool ComputeJacobian(const double* x, double* jacobian) const override;
};
#endif

/// Adds a state block of 16 parameters; `manifold` must outlive the problem and is not owned by it.
void addStateBlock(ceres::Problem& problem, double* block, StateManifold& manifold);

}  // namespace rio_t
