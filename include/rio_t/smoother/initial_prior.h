#pragma once

#include "rio_t/factors/prior_factor.h"
#include "rio_t/imu/noise.h"
#include "rio_t/smoother/options.h"

namespace rio_t {

/// What is known of the first state after standing still for `duration` seconds. Yaw and position define W.
/// The mean accelerometer is gravity plus b_a: tilt and b_a are known together far better than each of them
/// (docs/method.md, eq. 7a). `gravity` [m/s^2].
NodePrior priorAtRest(const SmootherOptions& options, const ImuNoise& noise, const StateBlock& x,
                      double gravity, double duration);

}  // namespace rio_t
