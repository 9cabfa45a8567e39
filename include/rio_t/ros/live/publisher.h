#pragma once

#include <nav_msgs/Path.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_broadcaster.h>

#include <optional>
#include <string>
#include <vector>

#include "rio_t/ros/live/session.h"
#include "rio_t/ros/parameters/parameters.h"

namespace rio_t {

/// Everything that the live node says, as messages. `odometry` belongs to the IMU thread, `result` to the
/// optimisation thread; they share nothing. Topics of one radar are in its name's namespace, where the radars
/// have names.
class LivePublisher {
 public:
  LivePublisher(const Config& config, const ros::NodeHandle& private_node);

  void odometry(const NavigationState& state, double rate_sigma);  ///< ~odom and tf
  /// ~odom_optimized, ~imu_bias, ~path; of the radar: ~time_offset, ~ego_velocity, ~points, ~inliers and,
  /// where they are estimated, ~extrinsics and tf. ~map, where landmarks are on.
  void result(const LiveSession::Result& live, double rate_sigma);
  /// base_link_frame -> radar_frame of each radar as static tf, unless it is estimated.
  void extrinsics(const std::vector<Extrinsics>& T_IR);
  void clearPath();  ///< optimisation thread

 private:
  struct Radar {
    Radar(const Config& config, const ros::NodeHandle& private_node);

    std::string frame;
    ros::Publisher time_offset, ego_velocity, points, inliers;
    std::optional<ros::Publisher> extrinsics;  ///< none if they are not estimated
  };

  void extrinsicsOf(const Radar& radar, const LiveSession::Result& live);
  void map(const ScanResult& result);
  void extendPath(const NavigationState& state);

  const Config config_;
  std::vector<Radar> radars_;
  ros::Publisher odom_, odom_optimized_, path_, imu_bias_;
  std::optional<ros::Publisher> map_;  ///< none without landmarks
  // None where publish_tf is false. One for each thread: they share nothing.
  std::optional<tf2_ros::TransformBroadcaster> tf_, radar_tf_;
  std::optional<tf2_ros::StaticTransformBroadcaster> static_tf_;
  nav_msgs::Path path_message_;  // optimisation thread only
};

}  // namespace rio_t
