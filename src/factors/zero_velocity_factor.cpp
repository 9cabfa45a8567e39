#include "rio_t/factors/zero_velocity_factor.h"

namespace rio_t {

bool ZeroVelocityFactor::Evaluate(double const* const* parameters, double* residuals,
                                  double** jacobians) const {
  Eigen::Map<Eigen::Vector3d>{residuals} = weight_ * StateView(parameters[0]).v_W;
  if (jacobians == nullptr || jacobians[0] == nullptr) return true;
  Eigen::Map<StateJacobian<3>> J(jacobians[0]);
  J.setZero();
  J.middleCols<3>(StateBlock::kVStored).diagonal().setConstant(weight_);
  return true;
}

}  // namespace rio_t
