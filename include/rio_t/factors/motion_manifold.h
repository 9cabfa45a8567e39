#pragma once

#include "rio_t/factors/state_block.h"
#include "rio_t/graph/manifold.h"

namespace rio_t {

/// The motion part of StateBlock as a Manifold, with the same `boxplus`: theta in the first three of the four
/// numbers of the quaternion, then p_W and v_W.
class MotionManifold final : public Manifold {
 public:
  MotionManifold();
  void plus(const double* x, const double* delta, double* x_plus_delta) const override;
  Eigen::VectorXd minus(const double* y, const double* x) const override;
  Eigen::MatrixXd minusJacobian(const double* y, const double* x) const override;
  std::optional<PointFromNode> see(const double* x, const double* point) const override;  ///< in I
};

}  // namespace rio_t
