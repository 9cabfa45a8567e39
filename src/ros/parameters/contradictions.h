#pragma once

#include <string>
#include <vector>

#include "rio_t/ros/parameters/config.h"

namespace rio_t {

/// What single values cannot show: one line for each contradiction between them.
std::vector<std::string> contradictions(const Config& config);

}  // namespace rio_t
