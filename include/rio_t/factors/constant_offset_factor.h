#pragma once

#include <ceres/sized_cost_function.h>

namespace rio_t {

/// The offset changes slowly, paper eq. (8)-(10): residual (t_O,k - t_O,k-1) / sigma. Blocks: t_O,k-1, t_O,k.
class ConstantOffsetFactor final : public ceres::SizedCostFunction<1, 1, 1> {
 public:
  /// `sigma`: standard deviation of the change between the two states [s].
  explicit ConstantOffsetFactor(double sigma) : weight_(1.0 / sigma) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    residuals[0] = weight_ * (parameters[1][0] - parameters[0][0]);
    if (jacobians == nullptr) return true;
    if (jacobians[0] != nullptr) jacobians[0][0] = -weight_;
    if (jacobians[1] != nullptr) jacobians[1][0] = weight_;
    return true;
  }

 private:
  double weight_ = 0.0;
};

}  // namespace rio_t
