#pragma once

#include <nav_msgs/Path.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_broadcaster.h>

#include <optional>
#include <vector>

#include "rio_t/ros/live/session.h"
#include "rio_t/ros/parameters/parameters.h"

namespace rio_t {

/// Everything that the live node says, as messages. `odometry` belongs to the IMU thread, `result` to the
/// optimisation thread; they share nothing.
class LivePublisher {
 public:
  LivePublisher(const Config& config, ros::NodeHandle private_node);

  void odometry(const NavigationState& state, double rate_sigma);  ///< ~odom and tf
  /// ~odom_optimized, ~time_offset, ~imu_bias, ~path, ~ego_velocity, ~points, ~inliers.
  void result(const LiveSession::Result& live, double rate_sigma);
  /// base_link_frame -> radar_frame, for display.
  void extrinsics(const Extrinsics& T_IR);
  void clearPath();  ///< optimisation thread

 private:
  void publishCloud(const ros::Publisher& publisher, const RadarScan& scan,
                    const std::vector<std::size_t>& indices) const;
  void extendPath(const NavigationState& state);

  const Config config_;
  ros::Publisher odom_, odom_optimized_, time_offset_, ego_velocity_, points_, inliers_, path_, imu_bias_;
  std::optional<tf2_ros::TransformBroadcaster> tf_;  // none where publish_tf is false, as the next
  std::optional<tf2_ros::StaticTransformBroadcaster> static_tf_;
  nav_msgs::Path path_message_;  // optimisation thread only
};

}  // namespace rio_t
