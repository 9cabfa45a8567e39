#pragma once

#include <string>

#include "../text.h"
#include "rio_t/ros/parameters/config.h"

/// Texts for people that name a radar if there are several.
namespace rio_t {

/// E.g. "time offset left".
inline std::string withName(const std::string& what, const Config& radar, const std::string& between = " ") {
  return radar.radar_name.empty() ? what : what + between + radar.radar_name;
}

/// The beginning of a message to people: "radar left: ", or nothing for the only radar.
inline std::string beginning(const Config& radar) {
  return radar.radar_name.empty() ? "" : "radar " + radar.radar_name + ": ";
}

/// The reason for which a scan got no stamp, with the key to look at.
inline std::string whyNoStamp(const Config& radar, const std::string& reason) {
  const std::string key =
      reason == "stamp_out_of_range" ? "radar_stamp_shift: " + shortText(radar.radar_stamp_shift, 6)
      : radar.stamp_source == StampSource::kTrigger ? "trigger_topic: " + radar.trigger_topic
                                                    : "imu_topic: " + radar.imu_topic;
  return reason + " (stamp_source: " + toString(radar.stamp_source) + ", " + key + ")";
}

}  // namespace rio_t
