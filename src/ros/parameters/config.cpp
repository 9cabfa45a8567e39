#include "rio_t/ros/parameters/config.h"

#include <utility>

#include "../text.h"

namespace rio_t {

std::string toString(StampSource source) {
  return source == StampSource::kHeader ? "header" : source == StampSource::kTrigger ? "trigger" : "arrival";
}

PointCloudFormat pointCloudFormat(const Config& config) {
  PointCloudFormat format = pointCloudPreset(config.radar_format);
  const PointCloudOverrides& overrides = config.radar_overrides;
  format.coordinates = overrides.coordinates.value_or(format.coordinates);
  format.axes = overrides.axes.value_or(format.axes);
  format.power_unit = overrides.power_unit.value_or(format.power_unit);
  format.size_from_data = overrides.size_from_data.value_or(format.size_from_data);
  if (overrides.doppler_sign != 0) format.doppler_sign = overrides.doppler_sign;
  const std::pair<const std::string*, std::string*> names[] = {
      {&overrides.x, &format.x},
      {&overrides.y, &format.y},
      {&overrides.z, &format.z},
      {&overrides.azimuth, &format.azimuth},
      {&overrides.elevation, &format.elevation},
      {&overrides.range, &format.range},
      {&overrides.doppler, &format.doppler},
      {&overrides.power, &format.power},
  };
  for (const auto& [from, to] : names) {
    if (!from->empty()) *to = *from;
  }
  return format;
}

std::vector<Config> configsOfRadars(const Config& config) {
  return config.radars.empty() ? std::vector<Config>{config} : config.radars;
}

bool hasLeverArm(const Config& radar) {
  return radar.lever_arm || radar.extrinsics_source == ExtrinsicsSource::kTf;
}

Config withTopics(Config config, const TopicResolver& resolve) {
  const std::string section = prefixOf(config.radar_name);
  const std::pair<std::string, std::string*> topics[] = {
      {"imu_topic", &config.imu_topic},
      {"barometer_topic", &config.barometer_topic},
      {section + "radar_topic", &config.radar_topic},
      {section + "trigger_topic", &config.trigger_topic},
      {"ground_truth_topic", &config.ground_truth_topic},
  };
  for (const auto& [key, topic] : topics)
    if (!topic->empty()) *topic = resolve(key, *topic);
  for (Config& radar : config.radars) radar = withTopics(radar, resolve);
  return config;
}

std::vector<InputTopic> inputTopics(const Config& config) {
  std::vector<InputTopic> topics = {{"imu_topic", config.imu_topic, "sensor_msgs/Imu"}};
  if (!config.barometer_topic.empty())
    topics.push_back({"barometer_topic", config.barometer_topic, "sensor_msgs/FluidPressure"});
  for (const Config& radar : configsOfRadars(config)) {
    const std::string section = prefixOf(radar.radar_name);
    topics.push_back({section + "radar_topic", radar.radar_topic, "sensor_msgs/PointCloud2"});
    if (radar.stamp_source == StampSource::kTrigger)
      topics.push_back({section + "trigger_topic", radar.trigger_topic, "std_msgs/Header"});
  }
  return topics;
}

std::string withoutSlash(const std::string& frame) {
  return !frame.empty() && frame.front() == '/' ? frame.substr(1) : frame;
}

}  // namespace rio_t
