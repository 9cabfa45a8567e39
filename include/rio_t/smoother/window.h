#pragma once

#include <ceres/loss_function.h>
#include <ceres/sized_cost_function.h>

#include <memory>
#include <vector>

#include "rio_t/core/time.h"
#include "rio_t/factors/constant_offset_factor.h"
#include "rio_t/factors/imu_factor.h"
#include "rio_t/factors/prior_factor.h"
#include "rio_t/factors/zero_velocity_factor.h"
#include "rio_t/factors/state_block.h"

namespace rio_t {

/// Any model of the radar: 3 residuals on a state and t_O.
using RadarCost = ceres::SizedCostFunction<3, StateBlock::kSize, 1>;

struct RadarTerm {
  Time stamp;
  std::unique_ptr<RadarCost> cost;
};

/// A state at one time, with the factors that reach back from it.
struct WindowNode {
  Time time;
  StateBlock x;
  double t_O = 0.0;                                            ///< [s]
  double offset_step_variance = 0.0;                           ///< of a step of t_O before this node [s^2]
  std::unique_ptr<ImuFactor> imu_from_previous;                ///< null for the first node
  std::unique_ptr<ConstantOffsetFactor> offset_from_previous;  ///< null for the first node
  std::vector<RadarTerm> radar;
  std::unique_ptr<ZeroVelocityFactor> rest;  ///< null where the platform is not known to be at rest
};

/// The factor graph: a chain of nodes in the order of their times, with a prior on the first.
struct Window {
  std::unique_ptr<PriorFactor> prior;
  std::vector<WindowNode> nodes;
  std::unique_ptr<ceres::LossFunction> loss;  ///< on the radar; null: none
  bool offset_known = false;                  ///< t_O is held
  double max_time_offset = 0.0;               ///< [s] bound on |t_O|
};

}  // namespace rio_t
