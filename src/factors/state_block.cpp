#include "rio_t/factors/state_block.h"

#include "rio_t/factors/motion_manifold.h"

namespace rio_t {
namespace {

using Biases = Eigen::Matrix<double, StateBlock::kBiases, 1>;

Eigen::Map<const Biases> biases(const double* from) { return Eigen::Map<const Biases>(from); }

}  // namespace

void boxplus(const double* x, const double* delta, double* x_plus_delta) {
  MotionManifold().plus(x, delta, x_plus_delta);
  Eigen::Map<Biases>{x_plus_delta + StateBlock::kMotion} =
      biases(x + StateBlock::kMotion) + biases(delta + StateBlock::kMotionTangent);
}

StateTangent boxminus(const double* y, const double* x) {
  StateTangent delta;
  delta << MotionManifold().minus(y, x), biases(y + StateBlock::kMotion) - biases(x + StateBlock::kMotion);
  return delta;
}

}  // namespace rio_t
