#pragma once

#include <vector>

#include "inspect_keys.h"
#include "inspect_radar.h"

namespace rio_t {

/// The configuration for an IMU and radars as they were found. What the user has `told` stands in it as it
/// is.
ProposedConfig proposedConfig(const ImuInspection& imu, const std::vector<RadarInspection>& radars,
                              const ParameterEntries& told);

}  // namespace rio_t
