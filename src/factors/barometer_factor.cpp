#include "rio_t/factors/barometer_factor.h"

namespace rio_t {

bool BarometerFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const StateView x(parameters[0]);
  residuals[0] = weight_ * (x.p_W.z() + delay_ * x.v_W.z() + parameters[1][0] - height_);
  if (jacobians == nullptr) return true;
  if (jacobians[0] != nullptr) {
    Eigen::Map<StateJacobian<1>> J(jacobians[0]);
    J.setZero();
    J(StateBlock::kPStored + 2) = weight_;
    J(StateBlock::kVStored + 2) = weight_ * delay_;
  }
  if (jacobians[1] != nullptr) jacobians[1][0] = weight_;
  return true;
}

}  // namespace rio_t
