#pragma once

#include "rio_t/factors/state_block.h"
#include "rio_t/imu/buffer.h"

namespace rio_t {

/// `x` at `from`, carried by the IMU to `to`, forwards or backwards, at its own biases.
StateBlock carried(const StateBlock& x, Time from, Time to, const ImuBuffer& imu, const Eigen::Vector3d& g_W);

}  // namespace rio_t
