#pragma once

#include <ros/time.h>
#include <rosbag/bag.h>
#include <rosbag/message_instance.h>
#include <rosbag/view.h>

#include <boost/shared_ptr.hpp>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "rio_t/evaluation/trajectory.h"
#include "rio_t/ros/parameters/config.h"

/// Bags as files: what is in them, and errors that name them.
namespace rio_t {

std::runtime_error bagError(const std::string& bag, const std::string& what);
/// The same for an exception that was thrown while messages were read. If rosbag threw it, the text says that
/// the bag may be damaged.
std::runtime_error bagError(const std::string& bag, const std::exception& thrown);

/// Creates a bag and calls `write` to fill it. If that fails, removes the file. Throws std::runtime_error
/// that names the bag if rosbag failed; all other exceptions pass.
void writeBag(const std::string& path, const std::function<void(rosbag::Bag&)>& write);

/// Bags that are played as one, in the order of their record times.
class Bags {
 public:
  /// Opens them. Throws bagError for one that cannot be read.
  explicit Bags(const std::vector<std::string>& paths);

  /// For messages: "a.bag, b.bag".
  const std::string& name() const { return name_; }
  /// Adds what `query` finds to the view.
  void addTo(rosbag::View* view, const std::function<bool(const rosbag::ConnectionInfo*)>& query,
             const ros::Time& begin = ros::TIME_MIN, const ros::Time& end = ros::TIME_MAX) const;
  /// Returns the type of each topic. A topic with two types gets "A and B", which no reader accepts.
  std::map<std::string, std::string> typesByTopic() const;
  /// The record times of the first and the last message. Throws bagError if there is none.
  std::pair<ros::Time, ros::Time> span() const;

 private:
  std::string name_;
  std::vector<std::unique_ptr<rosbag::Bag>> bags_;
};

/// "/imu (sensor_msgs/Imu), ..."
std::string topicsText(const std::map<std::string, std::string>& types);
/// Throws bagError that names all wanted topics that are missing or have another type.
void checkTopics(const std::string& bag, const std::map<std::string, std::string>& types,
                 const std::vector<InputTopic>& wanted);

/// Returns begin and end of the part to play, as bag_start and bag_duration set it.
std::pair<ros::Time, ros::Time> playedSpan(const Bags& bags, const Config& config);

/// Poses of a topic of geometry_msgs/PoseStamped, in the order of their stamps. Throws
/// std::runtime_error for one that is not finite or whose quaternion is not of norm 1.
Trajectory readPoses(const Bags& bags, const std::string& topic);

template <typename Message>
boost::shared_ptr<Message> read(const rosbag::MessageInstance& instance) {
  boost::shared_ptr<Message> message = instance.instantiate<Message>();
  if (!message)
    throw std::runtime_error("topic " + instance.getTopic() + ": a message of another version of its type");
  return message;
}

}  // namespace rio_t
