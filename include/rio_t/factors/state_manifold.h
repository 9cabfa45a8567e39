#pragma once

#include <memory>

#include "rio_t/factors/state_block.h"
#include "rio_t/graph/manifold.h"

namespace rio_t {

/// StateBlock as a Manifold: theta in the first three of the four numbers of the quaternion.
class StateManifold final : public Manifold {
 public:
  StateManifold();
  void plus(const double* x, const double* delta, double* x_plus_delta) const override;
  Eigen::VectorXd minus(const double* y, const double* x) const override;
  Eigen::MatrixXd minusJacobian(const double* y, const double* x) const override;
};

}  // namespace rio_t
