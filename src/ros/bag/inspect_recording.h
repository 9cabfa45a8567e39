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

/// The recording that check_bag inspects, with every topic that may serve.
namespace rio_t {

struct ImuTopic {
  std::string topic;
  std::vector<ImuMeasurement> written;  ///< in the units of the driver, including those with a stamp of zero
  std::vector<MessageTimes> times;
  Publishers publishers;
};

struct CloudTopic {
  std::string topic;
  std::vector<sensor_msgs::PointCloud2::ConstPtr> messages;
  std::vector<MessageTimes> times;
  std::uint64_t copies = 0;  ///< messages that equal the one before
  Publishers publishers;
};

struct HeaderTopic {
  std::string topic;
  std::vector<std_msgs::Header> messages;
  std::vector<MessageTimes> times;
};

struct Recording {
  std::vector<std::string> bags;             ///< the parts of the recording
  std::map<std::string, std::string> types;  ///< of all topics
  double length = 0.0;                       ///< [s] of the bag
  double read = 0.0;                         ///< [s] of the bag that were read
  std::vector<ImuTopic> imus;
  std::vector<CloudTopic> clouds;
  std::vector<HeaderTopic> headers;
};

/// Reads the topics and the seconds of a recording that `request` asks for. Throws std::runtime_error that
/// names the bags.
Recording readRecording(const std::vector<std::string>& paths, const CheckRequest& request);

}  // namespace rio_t
