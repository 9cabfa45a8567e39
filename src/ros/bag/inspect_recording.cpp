#include "inspect_recording.h"

#include <rosbag/view.h>
#include <sensor_msgs/Imu.h>
#include <tf2_eigen/tf2_eigen.h>

#include <algorithm>
#include <boost/algorithm/cxx11/any_of.hpp>
#include <iterator>
#include <set>
#include <utility>

#include "bag_file.h"
#include "bag_frames.h"
#include "inspect_format.h"
#include "rio_t/imu/input_check.h"
#include "rio_t/ros/messages/conversions.h"

namespace rio_t {
namespace {

constexpr const char* kImuType = "sensor_msgs/Imu";
constexpr const char* kCloudType = "sensor_msgs/PointCloud2";
constexpr const char* kHeaderType = "std_msgs/Header";

template <typename Topic>
Topic& topicOf(const std::string& name, std::vector<Topic>* topics) {
  const auto found =
      std::find_if(topics->begin(), topics->end(), [&](const Topic& each) { return each.topic == name; });
  if (found != topics->end()) return *found;
  topics->emplace_back().topic = name;
  return topics->back();
}

bool isCopy(const sensor_msgs::PointCloud2& a, const sensor_msgs::PointCloud2& b) {
  return a.header.stamp == b.header.stamp && a.data == b.data;
}

void addImu(const sensor_msgs::Imu& message, Time record, ImuTopic* topic) {
  ImuMeasurement imu;
  imu.time = toTime(message.header.stamp);
  tf2::fromMsg(message.angular_velocity, imu.angular_velocity);
  tf2::fromMsg(message.linear_acceleration, imu.acceleration);
  topic->written.push_back(imu);
  topic->times.push_back({imu.time, record});
}

void readMessages(rosbag::View& view, const ParameterEntries& configured, Recording* recording) {
  std::set<std::string> judged, refused;  // topics with clouds
  for (const rosbag::MessageInstance& instance : view) {
    const Time record = toTime(instance.getTime());
    const std::string& type = instance.getDataType();
    const std::string& name = instance.getTopic();
    if (type == kImuType) {
      const auto message = rio_t::read<sensor_msgs::Imu>(instance);
      ImuTopic& topic = topicOf(name, &recording->imus);
      addImu(*message, record, &topic);
      topic.publishers.add(instance.getCallerId(), message->header.frame_id);
    } else if (type == kCloudType) {
      if (refused.count(name) != 0) continue;
      CloudTopic& topic = topicOf(name, &recording->clouds);
      topic.messages.emplace_back(rio_t::read<sensor_msgs::PointCloud2>(instance));
      topic.times.push_back({toTime(topic.messages.back()->header.stamp), record});
      topic.publishers.add(instance.getCallerId(), topic.messages.back()->header.frame_id);
      if (topic.messages.size() > 1 && isCopy(*topic.messages.back(), **std::prev(topic.messages.end(), 2)))
        ++topic.copies;
      // The first cloud with points shows whether the topic can serve. All clouds of a lidar would fill the
      // memory.
      const bool is_first = hasPoints(*topic.messages.back()) && judged.insert(name).second;
      if (is_first && !proposeFormat(topic, configured).fault.empty()) refused.insert(name);
    } else {
      HeaderTopic& topic = topicOf(name, &recording->headers);
      topic.messages.push_back(*rio_t::read<std_msgs::Header>(instance));
      topic.times.push_back({toTime(topic.messages.back().stamp), record});
    }
  }
}

}  // namespace

std::vector<std::vector<std::string>> recordingsOf(std::vector<std::string> paths) {
  struct Part {
    std::string path;
    ros::Time begin, end;
  };
  std::vector<Part> parts;
  for (std::string& path : paths) {
    const auto [begin, end] = Bags({path}).span();
    parts.push_back({std::move(path), begin, end});
  }
  std::stable_sort(parts.begin(), parts.end(),
                   [](const Part& a, const Part& b) { return a.begin < b.begin; });
  const double largest_gap = ImuInputCheckOptions().max_bridged_gap;
  std::vector<std::vector<std::string>> recordings;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const bool follows = k > 0 && parts[k].begin >= parts[k - 1].end &&
                         (parts[k].begin - parts[k - 1].end).toSec() <= largest_gap;
    if (!follows) recordings.emplace_back();
    recordings.back().push_back(parts[k].path);
  }
  return recordings;
}

Recording readRecording(const std::vector<std::string>& paths, const CheckRequest& request) {
  Recording recording;
  recording.bags = paths;
  const Bags bags(paths);
  recording.types = bags.typesByTopic();
  const auto [first, last] = bags.span();
  recording.length = (last - first).toSec();
  recording.read = request.duration > 0.0 ? std::min(request.duration, recording.length) : recording.length;
  const ros::Time end = recording.read < recording.length ? first + ros::Duration(recording.read) : last;
  const std::string imu_topic = topicOfBag(request.imu_topic, recording.types);
  std::vector<std::string> radar_topics;
  for (const std::string& topic : request.radar_topics)
    radar_topics.push_back(topicOfBag(topic, recording.types));
  const auto is_wanted = [&](const rosbag::ConnectionInfo* connection) {
    const std::string& type = connection->datatype;
    if (type == kImuType) return imu_topic.empty() || imu_topic == connection->topic;
    if (type == kCloudType)
      return radar_topics.empty() || boost::algorithm::any_of_equal(radar_topics, connection->topic);
    return type == kHeaderType;
  };
  rosbag::View view;
  bags.addTo(&view, is_wanted, first, end);
  try {
    readMessages(view, request.set, &recording);
  } catch (const std::exception& error) {
    throw bagError(bags.name(), error);
  }
  return recording;
}

}  // namespace rio_t
