#pragma once

#include <cstddef>
#include <vector>

#include "rio_t/core/time.h"
#include "rio_t/factors/radar_velocity_model.h"
#include "rio_t/factors/state_block.h"
#include "rio_t/imu/buffer.h"

namespace rio_t {

/// A node: its time and its state.
struct NodeEstimate {
  Time time;
  StateBlock x;
};

/// Index of the node nearest to `time`; `nodes` in the order of their times, not empty.
std::size_t nearestNode(const std::vector<NodeEstimate>& nodes, Time time);

/// Mean motion around the node k of `nodes`, in the order of their times. The weights fall linearly to zero
/// at `half_width` [s] to either side, as those of ImuBuffer::mean. `T_IR` is the mounting that was estimated
/// with the nodes. The factor is linear from `linear_from`.
SlowMotion slowMotion(const std::vector<NodeEstimate>& nodes, std::size_t k, double half_width,
                      const ImuBuffer& imu, const Extrinsics& T_IR, const Extrinsics& linear_from);

/// Projects the angular velocities onto the axes about which the platform turns in these motions.
void keepTurns(const std::vector<SlowMotion*>& motions);

}  // namespace rio_t
