#include "rio_t/factors/constant_offset_factor.h"

namespace rio_t {

bool ConstantOffsetFactor::Evaluate(double const* const* parameters, double* residuals,
                                    double** jacobians) const {
  residuals[0] = weight_ * (parameters[1][0] - parameters[0][0]);
  if (jacobians == nullptr) return true;
  if (jacobians[0] != nullptr) jacobians[0][0] = -weight_;
  if (jacobians[1] != nullptr) jacobians[1][0] = weight_;
  return true;
}

}  // namespace rio_t
