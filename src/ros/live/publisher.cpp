#include "rio_t/ros/live/publisher.h"

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <sensor_msgs/PointCloud2.h>

#include <boost/make_shared.hpp>
#include <numeric>

#include "rio_t/TimeOffset.h"
#include "rio_t/ros/cloud/point_cloud.h"
#include "rio_t/ros/messages/conversions.h"

namespace rio_t {
namespace {

/// As a shared pointer.
template <typename Message>
void publish(const ros::Publisher& publisher, Message message) {
  publisher.publish(boost::make_shared<const Message>(std::move(message)));
}

void publishCloud(const ros::Publisher& publisher, const RadarScan& scan,
                  const std::vector<std::size_t>& indices, const std::string& frame, Time stamp) {
  sensor_msgs::PointCloud2 cloud = toPointCloud2(scan, indices);
  cloud.header = toHeader(stamp, frame);
  publish(publisher, std::move(cloud));
}

}  // namespace

// Queues are deep if each message counts (seconds of odometry survive a busy subscriber), and shallow if only
// the newest counts.
LivePublisher::Radar::Radar(const Config& config, const ros::NodeHandle& private_node)
    : frame(config.radar_frame) {
  ros::NodeHandle node(private_node, config.radar_name);  // without a name, the same
  time_offset = node.advertise<TimeOffset>("time_offset", 200);
  ego_velocity = node.advertise<geometry_msgs::TwistWithCovarianceStamped>("ego_velocity", 200);
  innovation = node.advertise<geometry_msgs::TwistWithCovarianceStamped>("innovation", 200);
  points = node.advertise<sensor_msgs::PointCloud2>("points", 20);
  inliers = node.advertise<sensor_msgs::PointCloud2>("inliers", 20);
  if (config.odometry.smoother.estimate_extrinsics != EstimateExtrinsics::kNone)
    extrinsics = node.advertise<geometry_msgs::PoseWithCovarianceStamped>("extrinsics", 200);
}

LivePublisher::LivePublisher(const Config& config, const ros::NodeHandle& private_node)
    : config_(config),
      odom_rate_(config.odom_rate),
      tf_rate_(config.tf_rate),
      correct_stamps_(config.correct_stamps),
      path_max_poses_(config.path_max_poses) {
  for (const Config& radar : configsOfRadars(config)) radars_.emplace_back(radar, private_node);
  ros::NodeHandle node = private_node;
  odom_ = node.advertise<nav_msgs::Odometry>("odom", 2000);
  odom_optimized_ = node.advertise<nav_msgs::Odometry>("odom_optimized", 200);
  // Not latched: that would serialise the whole path with each scan. A late subscriber gets the path at once.
  path_ = node.advertise<nav_msgs::Path>("path", 1, [this](const ros::SingleSubscriberPublisher& subscriber) {
    const nav_msgs::Path so_far = path();
    if (!so_far.poses.empty()) subscriber.publish(so_far);
  });
  imu_bias_ = node.advertise<ImuBias>("imu_bias", 200);
  if (config_.odometry.landmarks.enabled) map_ = node.advertise<sensor_msgs::PointCloud2>("map", 1, true);
  path_message_.header.frame_id = config_.odom_frame;
  if (config_.publish_tf) tf_.emplace();
  if (config_.publish_radar_tf) {
    radar_tf_.emplace();
    static_tf_.emplace();
  }
}

void LivePublisher::tune(const Config& config) {
  odom_rate_.set(config.odom_rate);
  tf_rate_.set(config.tf_rate);
  correct_stamps_ = config.correct_stamps;
  path_max_poses_ = config.path_max_poses;
}

bool LivePublisher::odometry(const BodyOdometry& body) {
  if (tf_ && tf_rate_.isDue(body.time)) {
    ++tf_sent_;
    tf_->sendTransform(toTransform(body, config_.odom_frame, config_.base_link_frame, config_.invert_tf));
  }
  if (!odom_rate_.isDue(body.time)) return false;
  publish(odom_, toOdometry(body, config_.odom_frame, config_.base_link_frame));
  return true;
}

void LivePublisher::result(const LiveSession::Result& live, const Frames& frames) {
  const ScanResult& result = live.result;
  Radar& radar = radars_.at(result.scan.radar);
  const Time stamp = correct_stamps_ ? live.measured_at : result.scan.stamp;
  radarFrame(radar, live, frames, stamp);  // first: who shows a cloud needs its tf
  if (isValid(result.ego_velocity.status))
    publish(radar.ego_velocity,
            toTwist(result.ego_velocity.v_R, result.ego_velocity.covariance, stamp, radar.frame));
  if (result.innovation)
    publish(radar.innovation, toTwist(result.innovation->d, result.innovation->S, stamp, radar.frame));
  if (radar.points.getNumSubscribers() > 0) {
    std::vector<std::size_t> all(result.scan.points.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    publishCloud(radar.points, result.scan, all, radar.frame, stamp);
  }
  if (radar.inliers.getNumSubscribers() > 0 && isValid(result.ego_velocity.status))
    publishCloud(radar.inliers, result.scan, result.ego_velocity.inliers, radar.frame, stamp);
  if (!result.updated) return;
  if (map_ && result.landmarks && frames.world) map(result.landmarks->map, *frames.world, result.state.time);
  publish(imu_bias_, toImuBias(result.state, frames.imu));
  TimeOffset offset;
  offset.header = toHeader(result.scan.stamp, radar.frame);
  offset.offset = result.time_offset;
  offset.sigma = result.time_offset_sigma;
  offset.observable = static_cast<std::uint8_t>(live.offset_observable);
  publish(radar.time_offset, offset);
  if (radar.extrinsics)
    publish(*radar.extrinsics, toPose(result.T_IR, result.T_IR_covariance, stamp, frames.imu));
  if (!frames.body) return;
  publish(odom_optimized_, toOdometry(*frames.body, config_.odom_frame, config_.base_link_frame));
  extendPath(*frames.body);
}

void LivePublisher::radarFrame(Radar& radar, const LiveSession::Result& live, const Frames& frames,
                               Time stamp) {
  if (!frames.T_BI || !radar_tf_) return;
  geometry_msgs::TransformStamped transform =
      toTransform(live.T_IR, *frames.T_BI, config_.base_link_frame, radar.frame);
  if (!radar.extrinsics) {
    if (radar.has_static_tf) return;
    transform.header.stamp = ros::Time::now();
    static_tf_->sendTransform(transform);
    radar.has_static_tf = true;
    return;
  }
  // A stamp ahead of the IMU would make tf forget all that is older than it. Before the state is there, no
  // stamp has been judged.
  const std::string& why_not = live.result.rejected_because;
  if (why_not == "stamp_ahead_of_imu" || why_not == "before_initialization") return;
  if (why_not == "duplicate_stamp") return;  // tf has it
  // Also with a scan that is rejected: its cloud is shown.
  transform.header.stamp = toRosTime(stamp);
  radar_tf_->sendTransform(transform);
}

void LivePublisher::map(const std::vector<LandmarkPoint>& points, const WorldInOdom& T_OW, Time stamp) {
  sensor_msgs::PointCloud2 cloud = toPointCloud2(points, T_OW);
  cloud.header = toHeader(stamp, config_.odom_frame);
  publish(*map_, std::move(cloud));
}

void LivePublisher::extendPath(const BodyOdometry& body) {
  geometry_msgs::PoseStamped pose;
  const nav_msgs::Odometry odom = toOdometry(body, config_.odom_frame, config_.base_link_frame);
  pose.header = odom.header;
  pose.pose = odom.pose.pose;
  {
    const std::lock_guard<std::mutex> lock(path_mutex_);
    path_message_.header.stamp = odom.header.stamp;
    std::vector<geometry_msgs::PoseStamped>& poses = path_message_.poses;
    // A scan that comes late updates the same newest state once more.
    if (!poses.empty() && poses.back().header.stamp == pose.header.stamp) poses.pop_back();
    poses.push_back(pose);
    const std::size_t most = path_max_poses_;
    if (poses.size() > most) poses.erase(poses.begin(), poses.end() - static_cast<std::ptrdiff_t>(most));
  }
  if (path_.getNumSubscribers() > 0 && path_rate_.isDue(body.time)) publish(path_, path());
}

nav_msgs::Path LivePublisher::path() {
  const std::lock_guard<std::mutex> lock(path_mutex_);
  return path_message_;
}

void LivePublisher::clear() {
  {
    const std::lock_guard<std::mutex> lock(path_mutex_);
    path_message_.poses.clear();
  }
  publish(path_, path());
  if (map_) map({}, {}, Time());
}

}  // namespace rio_t
