#pragma once

#include <string>
#include <vector>

#include "inspect_keys.h"
#include "inspect_recording.h"
#include "rio_t/radar/scan.h"
#include "rio_t/ros/cloud/stamping.h"

namespace rio_t {

/// The source of the stamps that fits a radar.
struct StampProposal {
  ProposedKeys keys;
  StampingOptions options;
  std::string text;              ///< what the stamps are like, as one phrase
  std::vector<std::string> odd;  ///< sentences
};

/// Chooses stamp_source for a cloud, unless the user has `configured` it. `imu` must have no stamps that are
/// out of place.
StampProposal proposeStamps(const Recording& recording, const std::vector<MessageTimes>& imu,
                            const CloudTopic& cloud, const ParameterEntries& configured);

/// Stamps scans as the programs would, one for each message. Returns those that get a stamp.
std::vector<RadarScan> stampScans(const Recording& recording, const std::vector<MessageTimes>& imu,
                                  const CloudTopic& cloud, const StampingOptions& options,
                                  const std::vector<RadarScan>& scans);

}  // namespace rio_t
