#pragma once

#include <string>

#include "rio_t/ros/live/monitor.h"

namespace rio_t {

/// The value of a key of a status, or that there is none.
inline std::string value(const LiveMonitor::Status& status, const std::string& key) {
  for (const auto& each : status.values)
    if (each.key == key) return each.value;
  return "no " + key;
}

}  // namespace rio_t
