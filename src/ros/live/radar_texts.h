#pragma once

#include <string>

#include "rio_t/ros/parameters/config.h"

/// Texts for people that name a radar if there are several.
namespace rio_t {

/// E.g. "time offset left".
inline std::string withName(const std::string& what, const Config& radar, const std::string& between = " ") {
  return radar.radar_name.empty() ? what : what + between + radar.radar_name;
}

/// The beginning of a message to people: it names the node and the radar, e.g. "/rio_t: radar left: ".
inline std::string beginning(const std::string& node, const Config& radar) {
  return withName(node, radar, ": radar ") + ": ";
}

}  // namespace rio_t
