#include "rio_t/ros/live/publisher.h"

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <sensor_msgs/PointCloud2.h>

#include <numeric>

#include "rio_t/TimeOffset.h"
#include "rio_t/ros/cloud/point_cloud.h"
#include "rio_t/ros/messages/conversions.h"

namespace rio_t {

namespace {

ros::NodeHandle namespaceOf(const Config& radar, const ros::NodeHandle& private_node) {
  return radar.radar_name.empty() ? private_node : ros::NodeHandle(private_node, radar.radar_name);
}

void publishCloud(const ros::Publisher& publisher, const RadarScan& scan,
                  const std::vector<std::size_t>& indices, const std::string& frame) {
  sensor_msgs::PointCloud2 cloud = toPointCloud2(scan, indices);
  cloud.header.stamp = toRosTime(scan.stamp);
  cloud.header.frame_id = frame;
  publisher.publish(cloud);
}

}  // namespace

// Queues are deep where a message stands for itself (seconds of odometry survive a busy subscriber), shallow
// where the newest tells all.
LivePublisher::Radar::Radar(const Config& config, const ros::NodeHandle& private_node)
    : frame(config.radar_frame) {
  ros::NodeHandle node = namespaceOf(config, private_node);
  time_offset = node.advertise<TimeOffset>("time_offset", 200);
  ego_velocity = node.advertise<geometry_msgs::TwistWithCovarianceStamped>("ego_velocity", 200);
  points = node.advertise<sensor_msgs::PointCloud2>("points", 20);
  inliers = node.advertise<sensor_msgs::PointCloud2>("inliers", 20);
  if (config.odometry.smoother.estimate_extrinsics != EstimateExtrinsics::kNone)
    extrinsics = node.advertise<geometry_msgs::PoseWithCovarianceStamped>("extrinsics", 200);
}

LivePublisher::LivePublisher(const Config& config, const ros::NodeHandle& private_node) : config_(config) {
  for (const Config& radar : configsOfRadars(config)) radars_.emplace_back(radar, private_node);
  ros::NodeHandle node = private_node;
  odom_ = node.advertise<nav_msgs::Odometry>("odom", 2000);
  odom_optimized_ = node.advertise<nav_msgs::Odometry>("odom_optimized", 200);
  path_ = node.advertise<nav_msgs::Path>("path", 1, true);
  imu_bias_ = node.advertise<ImuBias>("imu_bias", 200);
  if (config_.odometry.landmarks.enabled) map_ = node.advertise<sensor_msgs::PointCloud2>("map", 1, true);
  path_message_.header.frame_id = config_.odom_frame;
  if (config_.publish_tf) {
    tf_.emplace();
    radar_tf_.emplace();
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
  const Radar& radar = radars_.at(result.scan.radar);
  if (radar.extrinsics) extrinsicsOf(radar, live);  // first: who shows a cloud needs its tf
  if (isValid(result.ego_velocity.status))
    radar.ego_velocity.publish(toTwist(result.ego_velocity, result.scan.stamp, radar.frame));
  if (radar.points.getNumSubscribers() > 0) {
    std::vector<std::size_t> all(result.scan.points.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    publishCloud(radar.points, result.scan, all, radar.frame);
  }
  if (radar.inliers.getNumSubscribers() > 0 && isValid(result.ego_velocity.status))
    publishCloud(radar.inliers, result.scan, result.ego_velocity.inliers, radar.frame);
  if (!result.updated) return;
  if (map_ && result.landmarks) map(result);
  odom_optimized_.publish(toOdometry(result.state, rate_sigma, config_.odom_frame, config_.base_link_frame));
  imu_bias_.publish(toImuBias(result.state, config_.base_link_frame));
  TimeOffset offset;
  offset.header.stamp = toRosTime(result.scan.stamp);
  offset.header.frame_id = radar.frame;
  offset.offset = result.time_offset;
  offset.sigma = result.time_offset_sigma;
  offset.observable = static_cast<std::uint8_t>(live.offset_observable);
  radar.time_offset.publish(offset);
  extendPath(result.state);
}

void LivePublisher::extrinsicsOf(const Radar& radar, const LiveSession::Result& live) {
  const ScanResult& result = live.result;
  if (result.updated) {
    radar.extrinsics->publish(
        toPose(result.T_IR, result.T_IR_covariance, result.scan.stamp, config_.base_link_frame));
  }
  // A stamp ahead of the IMU would make tf forget all that is older than it. Before the state is there, no
  // stamp has been judged.
  const std::string& why_not = result.rejected_because;
  if (!radar_tf_ || why_not == "stamp_ahead_of_imu" || why_not == "before_initialization") return;
  // Also with a scan that is rejected: its cloud is shown.
  geometry_msgs::TransformStamped transform = toTransform(live.T_IR, config_.base_link_frame, radar.frame);
  transform.header.stamp = toRosTime(result.scan.stamp);
  radar_tf_->sendTransform(transform);
}

void LivePublisher::map(const ScanResult& result) {
  sensor_msgs::PointCloud2 cloud = toPointCloud2(result.landmarks->map);
  cloud.header.stamp = toRosTime(result.state.time);
  cloud.header.frame_id = config_.odom_frame;
  map_->publish(cloud);
}

void LivePublisher::extendPath(const NavigationState& state) {
  const nav_msgs::Odometry odom = toOdometry(state, 0.0, config_.odom_frame, config_.base_link_frame);
  geometry_msgs::PoseStamped pose;
  pose.header = odom.header;
  pose.pose = odom.pose.pose;
  path_message_.header.stamp = odom.header.stamp;
  std::vector<geometry_msgs::PoseStamped>& poses = path_message_.poses;
  // A scan that comes late updates the same newest state once more.
  if (!poses.empty() && poses.back().header.stamp == pose.header.stamp) poses.pop_back();
  poses.push_back(pose);
  if (poses.size() > config_.path_max_poses) poses.erase(poses.begin());
  if (path_.getNumSubscribers() > 0) path_.publish(path_message_);
}

void LivePublisher::clearPath() {
  path_message_.poses.clear();
  path_.publish(path_message_);
}

void LivePublisher::extrinsics(const std::vector<Extrinsics>& T_IR) {
  if (!static_tf_) return;
  for (std::size_t k = 0; k < radars_.size(); ++k) {
    if (radars_[k].extrinsics) continue;
    geometry_msgs::TransformStamped transform =
        toTransform(T_IR.at(k), config_.base_link_frame, radars_[k].frame);
    transform.header.stamp = ros::Time::now();
    static_tf_->sendTransform(transform);
  }
}

}  // namespace rio_t
