#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "rio_t/core/so3.h"
#include "rio_t/radar/extrinsics.h"
#include "rio_t/ros/parameters/parameters.h"

namespace rio_t {

inline const std::vector<Extrinsics> kMountings = {{{1.0, 0.3, 0.0}, so3::exp({0.0, 0.0, 0.5})},
                                                   {{1.0, -0.3, 0.0}, so3::exp({0.0, 0.0, -0.5})}};

/// Radars left, with header stamps, and right, with triggers. Both mountings are estimated.
inline Config twoRadars() {
  std::vector<std::string> texts = {"radars=[left, right]",
                                    "left/radar_topic=/left",
                                    "right/radar_topic=/right",
                                    "right/stamp_source=trigger",
                                    "right/trigger_topic=/right/trigger",
                                    "estimate_extrinsics=pose",
                                    "extrinsics_rotation_sigma=0.1",
                                    "extrinsics_translation_sigma=0.05"};
  ParameterEntries entries;
  for (const std::string& text : texts) entries.push_back(parseAssignment(text));
  Config config = makeConfig(entries);
  for (std::size_t k = 0; k < 2; ++k) {
    config.radars[k].odometry.radar.T_IR = config.odometry.radars[k].T_IR = kMountings[k];
    config.radars[k].has_default_mounting = false;
  }
  return config;
}

}  // namespace rio_t
