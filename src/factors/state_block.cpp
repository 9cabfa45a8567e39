#include "rio_t/factors/state_block.h"

#include "rio_t/core/so3.h"

namespace rio_t {

void boxplus(const double* x, const double* delta, double* x_plus_delta) {
  const Eigen::Quaterniond q = Eigen::Map<const Eigen::Quaterniond>(x);
  const Eigen::Vector3d theta = Eigen::Map<const Eigen::Vector3d>(delta);
  Eigen::Map<Eigen::Quaterniond>{x_plus_delta} = (q * so3::exp(theta)).normalized();
  constexpr int kLinear = StateBlock::kTangent - 3;
  Eigen::Map<Eigen::Matrix<double, kLinear, 1>>(x_plus_delta + StateBlock::kPStored) =
      Eigen::Map<const Eigen::Matrix<double, kLinear, 1>>(x + StateBlock::kPStored) +
      Eigen::Map<const Eigen::Matrix<double, kLinear, 1>>(delta + StateBlock::kP);
}

StateTangent boxminus(const double* y, const double* x) {
  StateTangent delta;
  const Eigen::Map<const Eigen::Quaterniond> q_x(x);
  const Eigen::Map<const Eigen::Quaterniond> q_y(y);
  delta.head<3>() = so3::log(q_x.conjugate() * q_y);
  constexpr int kLinear = StateBlock::kTangent - 3;
  delta.tail<kLinear>() = Eigen::Map<const Eigen::Matrix<double, kLinear, 1>>(y + StateBlock::kPStored) -
                          Eigen::Map<const Eigen::Matrix<double, kLinear, 1>>(x + StateBlock::kPStored);
  return delta;
}

}  // namespace rio_t
