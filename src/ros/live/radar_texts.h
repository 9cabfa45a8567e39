#pragma once

#include <string>

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

}  // namespace rio_t
