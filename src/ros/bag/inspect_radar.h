#pragma once

#include <optional>
#include <string>
#include <vector>

#include "inspect_format.h"
#include "inspect_recording.h"
#include "inspect_stamps.h"
#include "rio_t/inspection/imu_report.h"
#include "rio_t/inspection/mounting_search.h"
#include "rio_t/ros/bag/check_bag.h"
#include "rio_t/ros/diagnosis/run_evidence.h"

namespace rio_t {

/// "100 Hz, gaps: 2 (longest 0.50 s), duplicate stamps: 3"
std::string rateText(const StreamTiming& timing, int decimals, bool with_duplicates);

/// The IMU of a recording, ready to be compared with radars.
struct ImuInspection : Findings {
  std::string topic;
  std::vector<MessageTimes> times;  ///< of the samples whose stamps are in place
  ImuReport report;
  ProposedKeys keys;
};
ImuInspection inspectImuTopic(const ImuTopic& topic);

/// Up in I, unless the IMU turns over so much that no direction is up on average.
std::optional<Eigen::Vector3d> upOf(const ImuReport& report);

/// How to tell whether the accelerometer is negated. The data cannot: gravity shows it to a person only.
std::string howToTellNegated(const ImuReport& report);

/// [rad] Sigma of a turn below which the bag shows it.
constexpr double kObservedTurn = 0.3;
/// [rad] 15 degrees between two mountings: an eye does not misjudge one by more.
constexpr double kFarApart = 0.26;

/// A radar of a recording.
struct RadarInspection : Findings {
  std::string topic;
  ProposedKeys keys;
  bool usable = false;
  MountingSearch search;
  double points = 0.0;  ///< of the median scan

  /// The mounting may be far off, whatever its sigma.
  bool isSparse() const { return points < kSparsePoints; }
};
/// Whether the user has configured the rotation of the mounting.
bool isMountingConfigured(const ParameterEntries& configured);
/// The cloud is read as the user has `configured`.
RadarInspection inspectRadar(const Recording& recording, const ImuInspection& imu, const CloudTopic& cloud,
                             const ParameterEntries& configured);

}  // namespace rio_t
