#include "rio_t/ros/live/publisher.h"

#include <sensor_msgs/PointCloud2.h>

#include <numeric>

#include "rio_t/TimeOffset.h"
#include "rio_t/ros/cloud/point_cloud.h"
#include "rio_t/ros/messages/conversions.h"

namespace rio_t {

// Queues are deep where a message stands for itself (seconds of odometry survive a busy subscriber), shallow
// where the newest tells all.
LivePublisher::LivePublisher(const Config& config, ros::NodeHandle private_node)
    : config_(config),
      odom_(private_node.advertise<nav_msgs::Odometry>("odom", 2000)),
      odom_optimized_(private_node.advertise<nav_msgs::Odometry>("odom_optimized", 200)),
      time_offset_(private_node.advertise<TimeOffset>("time_offset", 200)),
      ego_velocity_(private_node.advertise<geometry_msgs::TwistWithCovarianceStamped>("ego_velocity", 200)),
      points_(private_node.advertise<sensor_msgs::PointCloud2>("points", 20)),
      inliers_(private_node.advertise<sensor_msgs::PointCloud2>("inliers", 20)),
      path_(private_node.advertise<nav_msgs::Path>("path", 1, true)),
      imu_bias_(private_node.advertise<ImuBias>("imu_bias", 200)) {
  path_message_.header.frame_id = config_.odom_frame;
  if (config_.publish_tf) {
    tf_.emplace();
    static_tf_.emplace();
  }
}

void LivePublisher::odometry(const NavigationState& state, double rate_sigma) {
  odom_.publish(toOdometry(state, rate_sigma, config_.odom_frame, config_.base_link_frame));
  if (tf_)
    tf_->sendTransform(toTransform(state, config_.odom_frame, config_.base_link_frame, config_.invert_tf));
}

void LivePublisher::result(const LiveSession::Result& live, double rate_sigma) {
  const ScanResult& result = live.result;
  if (isValid(result.ego_velocity.status))
    ego_velocity_.publish(toTwist(result.ego_velocity, result.scan.stamp, config_.radar_frame));
  if (points_.getNumSubscribers() > 0) {
    std::vector<std::size_t> all(result.scan.points.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    publishCloud(points_, result.scan, all);
  }
  if (inliers_.getNumSubscribers() > 0 && isValid(result.ego_velocity.status))
    publishCloud(inliers_, result.scan, result.ego_velocity.inliers);
  if (!result.updated) return;
  odom_optimized_.publish(toOdometry(result.state, rate_sigma, config_.odom_frame, config_.base_link_frame));
  imu_bias_.publish(toImuBias(result.state, config_.base_link_frame));
  TimeOffset offset;
  offset.header.stamp = toRosTime(result.scan.stamp);
  offset.header.frame_id = config_.radar_frame;
  offset.offset = result.time_offset;
  offset.sigma = result.time_offset_sigma;
  offset.observable = static_cast<std::uint8_t>(live.offset_observable);
  time_offset_.publish(offset);
  extendPath(result.state);
}

void LivePublisher::publishCloud(const ros::Publisher& publisher, const RadarScan& scan,
                                 const std::vector<std::size_t>& indices) const {
  sensor_msgs::PointCloud2 cloud = toPointCloud2(scan, indices);
  cloud.header.stamp = toRosTime(scan.stamp);
  cloud.header.frame_id = config_.radar_frame;
  publisher.publish(cloud);
}

void LivePublisher::extendPath(const NavigationState& state) {
  const nav_msgs::Odometry odom = toOdometry(state, 0.0, config_.odom_frame, config_.base_link_frame);
  geometry_msgs::PoseStamped pose;
  pose.header = odom.header;
  pose.pose = odom.pose.pose;
  path_message_.header.stamp = odom.header.stamp;
  std::vector<geometry_msgs::PoseStamped>& poses = path_message_.poses;
  poses.push_back(pose);
  if (poses.size() > config_.path_max_poses) poses.erase(poses.begin());
  if (path_.getNumSubscribers() > 0) path_.publish(path_message_);
}

void LivePublisher::clearPath() {
  path_message_.poses.clear();
  path_.publish(path_message_);
}

void LivePublisher::extrinsics(const Extrinsics& T_IR) {
  if (!static_tf_) return;
  geometry_msgs::TransformStamped transform = toTransform(T_IR, config_.base_link_frame, config_.radar_frame);
  transform.header.stamp = ros::Time::now();
  static_tf_->sendTransform(transform);
}

}  // namespace rio_t
