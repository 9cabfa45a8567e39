#pragma once

#include <Eigen/Core>

#include "rio_t/factors/state_block.h"
#include "rio_t/graph/normal_equations.h"
#include "rio_t/imu/noise.h"
#include "rio_t/smoother/options.h"

namespace rio_t {

/// Tangent of a state and the radar's time offset: the 15 of the state, then t_O.
constexpr int kNodeTangent = StateBlock::kTangent + 1;
using NodeVector = Eigen::Matrix<double, kNodeTangent, 1>;
using NodeMatrix = Eigen::Matrix<double, kNodeTangent, kNodeTangent>;

/// Prior on the first node and on t_O: residual r0 + J ((x, t_O) [-] (x0, t_O0)).
struct NodePrior {
  StateBlock x0;
  double t_O0 = 0.0;  ///< [s]
  NodeMatrix J = NodeMatrix::Zero();
  NodeVector r0 = NodeVector::Zero();
};

/// The prior with that information and gradient at (x0, t_O0).
NodePrior nodePrior(const Information& information, const StateBlock& x0, double t_O0);

/// Prior on the first state after `duration` seconds at rest. Yaw and position define W. The mean of the
/// accelerometer is gravity plus b_a, so tilt and b_a are known far better together than each by itself
/// (docs/method.md, eq. 7a). `gravity` [m/s^2].
NodePrior priorAtRest(const SmootherOptions& options, const ImuNoise& noise, const StateBlock& x,
                      double gravity, double duration);

}  // namespace rio_t
