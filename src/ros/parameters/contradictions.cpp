#include <cmath>

#include "../text.h"
#include "parameter_list.h"

namespace rio_t {
namespace {

/// Adds contradictions between the values of one radar.
void addContradictions(const Config& config, std::vector<std::string>* faults) {
  const std::string section = prefixOf(config.radar_name);
  if (config.odom_frame == config.base_link_frame)
    faults->push_back("odom_frame: expected another frame than base_link_frame, got \"" + config.odom_frame +
                      "\" for both");
  if (config.radar_frame == config.base_link_frame || config.radar_frame == config.odom_frame)
    faults->push_back(section + "radar_frame: expected a frame of its own, got \"" + config.radar_frame +
                      "\", which is base_link_frame or odom_frame");
  const RadarOptions& radar = config.odometry.radar;
  const EgoVelocityOptions& points = radar.ego_velocity;
  const double max_time_offset = config.odometry.smoother.max_time_offset;
  if (points.min_range >= points.max_range) {
    faults->push_back(section + "radar_min_range: expected less than radar_max_range (" +
                      numberText(points.max_range) + " m), got " + numberText(points.min_range));
  }
  if (std::abs(radar.time_offset_initial) > max_time_offset) {
    faults->push_back(section + "time_offset_initial: expected at most max_time_offset (" +
                      numberText(max_time_offset) + " s) in size, got " +
                      numberText(radar.time_offset_initial));
  }
  if (config.stamp_source == StampSource::kTrigger && config.trigger_topic.empty())
    faults->push_back(section + "trigger_topic: expected a topic, since stamp_source is trigger, got \"\"");
}

/// Adds topics of which two inputs expect different types.
void addSharedTopics(const Config& config, std::vector<std::string>* faults) {
  const std::vector<InputTopic> inputs = inputTopics(config);
  for (std::size_t k = 0; k < inputs.size(); ++k)
    for (std::size_t other = 0; other < k; ++other)
      if (inputs[k].topic == inputs[other].topic && inputs[k].type != inputs[other].type)
        faults->push_back(inputs[k].key + ": expected another topic than " + inputs[other].key + ", got \"" +
                          inputs[k].topic + "\" for both");
}

/// Adds contradictions between radars.
void addContradictionsAmong(const std::vector<Config>& radars, std::vector<std::string>* faults) {
  for (std::size_t k = 0; k < radars.size(); ++k) {
    const Config& radar = radars[k];
    for (std::size_t other = 0; other < k; ++other) {
      const auto same = [&](const char* key, const std::string& value) {
        faults->push_back(radar.radar_name + "/" + key + ": expected another than that of " +
                          radars[other].radar_name + ", got \"" + value + "\" for both");
      };
      if (radar.radar_topic == radars[other].radar_topic) same("radar_topic", radar.radar_topic);
      if (radar.radar_frame == radars[other].radar_frame) same("radar_frame", radar.radar_frame);
    }
    if (!radar.odometry.smoother.time_offset_shared) continue;
    const RadarOptions& first = radars.front().odometry.radar;
    const RadarOptions& own = radar.odometry.radar;
    if (own.time_offset_initial != first.time_offset_initial ||
        own.time_offset_sigma != first.time_offset_sigma) {
      faults->push_back(radar.radar_name +
                        "/: expected time_offset_initial and time_offset_sigma as those of " +
                        radars.front().radar_name + ", since time_offset_shared is true");
    }
  }
}

}  // namespace

std::vector<std::string> contradictions(const Config& config) {
  std::vector<std::string> faults;
  for (const Config& radar : configsOfRadars(config)) addContradictions(radar, &faults);
  addSharedTopics(config, &faults);
  addContradictionsAmong(config.radars, &faults);
  return faults;
}

}  // namespace rio_t
