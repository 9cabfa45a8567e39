#pragma once

#include <ceres/sized_cost_function.h>

#include "rio_t/factors/state_block.h"

namespace rio_t {

/// [m] Prior sigma of the bias, which is unknown at the start and after a step.
constexpr double kUnknownBarometerBias = 100.0;

/// A mean of barometric heights above the place of the first pressure, with a bias (docs/method.md, section
/// 5.10): residual (p_W,z + delay v_W,z + bias - height) / sigma. Blocks: motion, bias [m].
class BarometerFactor final : public ceres::SizedCostFunction<1, StateBlock::kMotion, 1> {
 public:
  /// `height` [m] is the mean over samples whose mean time is `delay` [s] after the state. `sigma` [m].
  BarometerFactor(double height, double delay, double sigma)
      : height_(height), delay_(delay), weight_(1.0 / sigma) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const MotionView x(parameters[0]);
    residuals[0] = weight_ * (x.p_W.z() + delay_ * x.v_W.z() + parameters[1][0] - height_);
    if (jacobians == nullptr) return true;
    MotionJacobian<1> J = MotionJacobian<1>::Zero();
    J[StateBlock::kPStored + 2] = weight_;
    J[StateBlock::kVStored + 2] = weight_ * delay_;
    store(J, jacobians[0]);
    if (jacobians[1] != nullptr) jacobians[1][0] = weight_;
    return true;
  }

 private:
  double height_, delay_, weight_;
};

}  // namespace rio_t
