#include "record_topics.h"

#include <ros/callback_queue.h>
#include <ros/master.h>
#include <ros/ros.h>
#include <rosbag/bag.h>
#include <topic_tools/shape_shifter.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "../bag/bag_file.h"

namespace rio_t {
namespace {

using Event = ros::MessageEvent<topic_tools::ShapeShifter const>;

bool isLatched(const Event& event) {
  const auto found = event.getConnectionHeader().find("latching");
  return found != event.getConnectionHeader().end() && found->second == "1";
}

bool isWanted(const std::string& type) {
  static const std::set<std::string> wanted = {"sensor_msgs/FluidPressure", "sensor_msgs/Imu",
                                               "sensor_msgs/PointCloud2", "std_msgs/Header",
                                               "tf2_msgs/TFMessage"};
  return wanted.count(type) != 0;
}

/// Writes what comes within `duration` [s].
void record(ros::NodeHandle& node, double duration, rosbag::Bag& bag, std::size_t* messages,
            std::size_t* without_time) {
  std::map<std::string, ros::Subscriber> subscribers;
  std::vector<std::pair<std::string, Event>> early;
  // The header names the publisher.
  const auto write = [&](const std::string& topic, const ros::Time& time, const Event& event) {
    bag.write(topic, time, event.getConstMessage(), event.getConnectionHeaderPtr());
    ++*messages;
  };
  const auto subscribe = [&](const std::string& topic) {
    const boost::function<void(const Event&)> keep = [&, topic](const Event& event) {
      // With use_sim_time there is no time before the first /clock, and a bag takes no message without one.
      if (event.getReceiptTime().isZero()) {
        ++*without_time;
        if (isLatched(event)) early.emplace_back(topic, event);  // a mounting on /tf_static comes only once
        return;
      }
      for (const auto& [early_topic, early_event] : early)
        write(early_topic, event.getReceiptTime(), early_event);
      early.clear();
      write(topic, event.getReceiptTime(), event);
    };
    constexpr std::uint32_t kQueue = 5000;
    subscribers[topic] = node.subscribe<topic_tools::ShapeShifter>(topic, kQueue, keep);
  };
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(duration);
  ros::WallTime look_again;
  while (ros::ok() && ros::WallTime::now() < end) {
    if (ros::WallTime::now() > look_again) {  // a driver may start later
      ros::master::V_TopicInfo topics;
      ros::master::getTopics(topics);
      for (const ros::master::TopicInfo& topic : topics) {
        if (isWanted(topic.datatype) && subscribers.count(topic.name) == 0) subscribe(topic.name);
      }
      look_again = ros::WallTime::now() + ros::WallDuration(1.0);
    }
    ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.1));
  }
}

}  // namespace

std::size_t recordTopics(const std::string& path, double duration) {
  if (!ros::master::check())
    throw std::runtime_error("--live: there is no ROS master at " + ros::master::getURI());
  ros::NodeHandle node;
  std::size_t messages = 0, without_time = 0;
  writeBag(path, [&](rosbag::Bag& bag) { record(node, duration, bag, &messages, &without_time); });
  if (messages == 0) std::filesystem::remove(path);  // it would be in the way of the next try
  if (messages == 0 && without_time > 0)
    throw std::runtime_error(
        "--live: use_sim_time is true, but /clock is silent: play with --clock, or set use_sim_time to "
        "false");
  return messages;
}

}  // namespace rio_t
