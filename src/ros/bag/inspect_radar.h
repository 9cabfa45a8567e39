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

struct ImuInspection : Findings {
  std::string topic;
  std::vector<MessageTimes> times;  ///< of the samples whose stamps are in order
  ImuReport report;
  ProposedKeys keys;
};
ImuInspection inspectImuTopic(const ImuTopic& topic);

/// The direction that points up in I. None if the IMU turns over so much that no direction is up on average.
std::optional<Eigen::Vector3d> upOf(const ImuReport& report);

/// Says how a person can tell whether the accelerometer is negated. The data alone cannot show it.
std::string howToTellNegated(const ImuReport& report);

/// [rad] The bag shows a rotation about an axis if its sigma is below this.
constexpr double kObservedTurn = 0.3;
/// [rad] 15 degrees: nobody misjudges a mounting by more by eye.
constexpr double kFarApart = 0.26;

struct RadarInspection : Findings {
  std::string topic;
  ProposedKeys keys;
  bool usable = false;
  MountingSearch search;
  double points = 0.0;  ///< in the median scan

  /// Whether the scans have so few points that the mounting may be far off, whatever its sigma.
  bool isSparse() const { return points < kSparsePoints; }
};
/// Whether the user has configured the rotation of the mounting.
bool isMountingConfigured(const ParameterEntries& configured);
/// Inspects a radar. Reads its clouds as the user has `configured`.
RadarInspection inspectRadar(const Recording& recording, const ImuInspection& imu, const CloudTopic& cloud,
                             const ParameterEntries& configured);

}  // namespace rio_t
