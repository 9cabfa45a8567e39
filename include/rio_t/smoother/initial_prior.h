#pragma once

#include "rio_t/factors/prior_factor.h"
#include "rio_t/smoother/options.h"

namespace rio_t {

/// What is known of the first state after standing still: the sigmas of the options, with yaw and position
/// defining W, and t_O from its prior. `gyro_bias_sigma` [rad/s]: of the mean that b_g comes from, added to
/// the option's in quadrature.
NodePrior priorAtRest(const SmootherOptions& options, const StateBlock& x, double gyro_bias_sigma);

}  // namespace rio_t
