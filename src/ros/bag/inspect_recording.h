#pragma once

#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Header.h>

#include <map>
#include <string>
#include <vector>

#include "publishers.h"
#include "rio_t/imu/measurement.h"
#include "rio_t/inspection/stream_timing.h"
#include "rio_t/ros/bag/check_bag.h"

/// A bag as an inspection reads it: every topic that may serve.
namespace rio_t {

struct ImuTopic {
  std::string topic;
  std::vector<ImuMeasurement> written;  ///< in the units of the driver; those with a stamp of zero, too
  std::vector<MessageTimes> times;
  Publishers publishers;
};

struct CloudTopic {
  std::string topic;
  std::vector<sensor_msgs::PointCloud2::ConstPtr> messages;
  std::vector<MessageTimes> times;
  std::uint64_t copies = 0;  ///< messages that are the same as the one before
  Publishers publishers;
};

struct HeaderTopic {
  std::string topic;
  std::vector<std_msgs::Header> messages;
  std::vector<MessageTimes> times;
};

struct Recording {
  std::vector<std::string> bags;             ///< its parts
  std::map<std::string, std::string> types;  ///< of all topics
  double length = 0.0;                       ///< [s] of the bag
  double read = 0.0;                         ///< [s] of it that was read
  std::vector<ImuTopic> imus;
  std::vector<CloudTopic> clouds;
  std::vector<HeaderTopic> headers;
};

/// Reads the topics and the seconds of a recording that `request` asks for. Throws std::runtime_error that
/// names the bags.
Recording readRecording(const std::vector<std::string>& paths, const CheckRequest& request);

}  // namespace rio_t
