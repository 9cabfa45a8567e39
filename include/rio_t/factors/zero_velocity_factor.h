#pragma once

#include <ceres/sized_cost_function.h>

#include "rio_t/factors/state_block.h"

namespace rio_t {

/// The platform is at rest: residual v_W / sigma. Block: state.
class ZeroVelocityFactor final : public ceres::SizedCostFunction<3, StateBlock::kSize> {
 public:
  /// `velocity_sigma` [m/s], per axis.
  explicit ZeroVelocityFactor(double velocity_sigma) : weight_(1.0 / velocity_sigma) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  double weight_ = 0.0;
};

}  // namespace rio_t
