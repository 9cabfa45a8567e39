#pragma once

#include <ros/time.h>
#include <rosbag/bag.h>
#include <rosbag/message_instance.h>

#include <boost/shared_ptr.hpp>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "rio_t/evaluation/trajectory.h"
#include "rio_t/ros/parameters/parameters.h"

/// Bags as files: what is in them, and errors that name them.
namespace rio_t {

std::runtime_error bagError(const std::string& bag, const std::string& what);

/// For reading. Throws bagError where that cannot be.
void openBag(const std::string& path, rosbag::Bag* bag);

/// By topic.
std::map<std::string, std::string> topicTypes(const rosbag::Bag& bag);

/// The topic of a configuration key and the type it must have.
struct Wanted {
  std::string key;
  std::string topic;
  std::string type;
};

/// Throws bagError that names all which are missing or of another type.
void checkTopics(const std::string& bag, const std::map<std::string, std::string>& types,
                 const std::vector<Wanted>& wanted);

/// Begin and end of what is played, by the keys bag_start and bag_duration.
std::pair<ros::Time, ros::Time> playedSpan(const std::string& path, const rosbag::Bag& bag,
                                           const Config& config);

/// Poses of a topic of geometry_msgs/PoseStamped, in the order of their stamps.
Trajectory readPoses(const rosbag::Bag& bag, const std::string& topic);

template <typename Message>
boost::shared_ptr<Message> read(const rosbag::MessageInstance& instance) {
  boost::shared_ptr<Message> message = instance.instantiate<Message>();
  if (!message)
    throw std::runtime_error("topic " + instance.getTopic() + ": a message of another version of its type");
  return message;
}

}  // namespace rio_t
