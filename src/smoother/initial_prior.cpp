#include "rio_t/smoother/initial_prior.h"

#include <cmath>

namespace rio_t {

NodePrior priorAtRest(const SmootherOptions& options, const StateBlock& x, double gyro_bias_sigma) {
  NodePrior prior;
  prior.x0 = x;
  prior.t_O0 = options.time_offset_initial;
  const Eigen::Vector3d sigma_W(options.prior_sigma_orientation, options.prior_sigma_orientation,
                                options.prior_sigma_yaw);
  // theta lives in I, the sigmas are given in W.
  prior.J.block<3, 3>(StateBlock::kTheta, StateBlock::kTheta) =
      sigma_W.cwiseInverse().asDiagonal() * x.q_WI().toRotationMatrix();
  const auto set = [&](int first, double sigma) {
    prior.J.diagonal().segment<3>(first).setConstant(1.0 / sigma);
  };
  set(StateBlock::kP, options.prior_sigma_position);
  set(StateBlock::kV, options.prior_sigma_velocity);
  set(StateBlock::kBg, std::hypot(options.prior_sigma_gyro_bias, gyro_bias_sigma));
  set(StateBlock::kBa, options.prior_sigma_accel_bias);
  prior.J(StateBlock::kTangent, StateBlock::kTangent) = 1.0 / options.time_offset_sigma;
  return prior;
}

}  // namespace rio_t
