#pragma once

#include <ceres/sized_cost_function.h>

#include "rio_t/factors/state_block.h"

namespace rio_t {

/// The platform is at rest: residual v_W / sigma. Block: motion.
class ZeroVelocityFactor final : public ceres::SizedCostFunction<3, StateBlock::kMotion> {
 public:
  /// `velocity_sigma` [m/s], per axis.
  explicit ZeroVelocityFactor(double velocity_sigma) : weight_(1.0 / velocity_sigma) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    Eigen::Map<Eigen::Vector3d>{residuals} = weight_ * MotionView(parameters[0]).v_W;
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    Eigen::Map<MotionJacobian<3>> J(jacobians[0]);
    J.setZero();
    J.middleCols<3>(StateBlock::kVStored).diagonal().setConstant(weight_);
    return true;
  }

 private:
  double weight_ = 0.0;
};

}  // namespace rio_t
