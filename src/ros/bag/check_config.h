#pragma once

#include <string>
#include <vector>

#include "inspect_keys.h"
#include "inspect_radar.h"
#include "inspect_recording.h"
#include "rio_t/ros/bag/check_bag.h"

namespace rio_t {

/// Proposes a configuration from what was found. It keeps what the user has `configured`.
ProposedConfig proposedConfig(const ImuInspection& imu, const std::vector<RadarInspection>& radars,
                              const ParameterEntries& configured);

/// Runs the odometry on the bag. `check` gets the configuration with which it runs best: `config`, or that of
/// one of its radars alone. `header`: lines for the beginning of the file.
void chooseByTrial(const Recording& recording, const std::string& header, const ProposedConfig& config,
                   BagCheck* check);

}  // namespace rio_t
