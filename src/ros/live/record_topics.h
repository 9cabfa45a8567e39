#pragma once

#include <cstddef>
#include <string>

namespace rio_t {

/// Records the topics that check_bag looks at (Imu, PointCloud2, Header, FluidPressure, tf) from the running
/// ROS master into a bag, for `duration` [s] of wall time. Needs ros::init. Returns the number of messages;
/// throws std::runtime_error if there is no master, or no time: use_sim_time without a /clock.
std::size_t recordTopics(const std::string& path, double duration);

}  // namespace rio_t
