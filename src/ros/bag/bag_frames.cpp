#include "bag_frames.h"

#include <rosbag/view.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/PointCloud2.h>
#include <tf2/buffer_core.h>
#include <tf2/exceptions.h>
#include <tf2_msgs/TFMessage.h>

#include <vector>

#include "../text.h"
#include "rio_t/ros/frames/frames.h"

namespace rio_t {
namespace {

/// The frame_id of the topic's first message; empty if there is none.
template <typename Message>
std::string firstFrame(const Bags& bags, const std::string& topic) {
  rosbag::View view;
  bags.addTo(&view, rosbag::TopicQuery(topic));
  return view.begin() == view.end() ? "" : read<Message>(*view.begin())->header.frame_id;
}

/// Returns T_IR by radar. `missing` gets the transforms that are missing; empty: none.
std::vector<Extrinsics> lookUp(const tf2::BufferCore& tf, const std::vector<Config>& radars,
                               const std::string& imu_frame, const std::vector<std::string>& cloud_frames,
                               std::string* missing) {
  missing->clear();
  std::vector<Extrinsics> T_IR;
  for (std::size_t k = 0; k < radars.size(); ++k) {
    T_IR.push_back(radars[k].odometry.radar.T_IR);
    if (radars[k].extrinsics_source != ExtrinsicsSource::kTf) continue;
    try {
      T_IR.back() = radarExtrinsics(tf, radars[k], imu_frame, cloud_frames[k]);
    } catch (const tf2::TransformException& error) {
      const std::string& name = radars[k].radar_name;
      appendItem(missing,
                 (name.empty() ? "" : "radar " + name + ": ") + "no tf from " + cloud_frames[k] + " to " +
                     imu_frame + " (extrinsics_source: tf; " + error.what() + ")",
                 "; ");
    }
  }
  return T_IR;
}

}  // namespace

std::string topicOfBag(const std::string& configured, const std::map<std::string, std::string>& types) {
  if (configured.empty() || types.count(configured) != 0) return configured;
  std::string other = configured.front() == '/' ? configured.substr(1) : "/" + configured;
  if (types.count(other) != 0) return other;
  return configured.front() == '/' ? configured : other;
}

Config withExtrinsicsOfBag(Config config, const Bags& bags) {
  std::vector<Config> radars = configsOfRadars(config);
  std::vector<std::string> cloud_frames;
  bool is_wanted = false;
  for (Config& radar : radars) {
    const bool wants = radar.extrinsics_source == ExtrinsicsSource::kTf;
    is_wanted = is_wanted || wants;
    radar.publish_radar_tf = false;  // the bag runner publishes no tf
    cloud_frames.push_back(
        wants ? cloudFrame(radar, firstFrame<sensor_msgs::PointCloud2>(bags, radar.radar_topic)) : "");
  }
  if (!is_wanted) return config;
  const std::string imu_frame = imuFrame(config, firstFrame<sensor_msgs::Imu>(bags, config.imu_topic));
  // A mounting does not move, even if it is published on /tf: the first transform of each frame holds for
  // good.
  tf2::BufferCore tf;
  std::string missing;
  std::vector<Extrinsics> T_IR = lookUp(tf, radars, imu_frame, cloud_frames, &missing);
  for (const char* topic : {"/tf_static", "/tf"}) {
    rosbag::View view;
    bags.addTo(&view, rosbag::TopicQuery(std::vector<std::string>{topic, topic + 1}));
    for (const rosbag::MessageInstance& instance : view) {
      if (missing.empty()) break;
      bool is_new = false;
      const auto message = read<tf2_msgs::TFMessage>(instance);
      for (const auto& transform : message->transforms) {
        if (tf._frameExists(transform.child_frame_id) &&
            tf.canTransform(transform.header.frame_id, transform.child_frame_id, ros::Time(0)))
          continue;
        is_new = tf.setTransform(transform, bags.name(), true) || is_new;
      }
      if (is_new) T_IR = lookUp(tf, radars, imu_frame, cloud_frames, &missing);
    }
  }
  if (!missing.empty()) {
    const std::string frames = tf.allFramesAsString();
    throw bagError(bags.name(),
                   missing + (frames.empty() ? "; the bag has no tf" : "; the bag's tf has: " + frames));
  }
  config.odometry.radar.T_IR = T_IR.front();
  for (std::size_t k = 0; k < config.radars.size(); ++k)
    config.radars[k].odometry.radar.T_IR = config.odometry.radars[k].T_IR = T_IR[k];
  return config;
}

}  // namespace rio_t
