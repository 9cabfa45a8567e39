#include "mounting_parameters.h"

#include <algorithm>
#include <variant>

#include "../text.h"
#include "rio_t/core/angle.h"
#include "rio_t/radar/mounting.h"

namespace rio_t {
namespace {

const ParameterEntry* lastOf(const ParameterEntries& entries, const std::string& key) {
  const ParameterEntry* last = nullptr;
  for (const ParameterEntry& entry : entries) {
    if (entry.key == key) last = &entry;
  }
  return last;
}

/// `[]` stands for "not given".
bool isGiven(const ParameterEntry* entry) {
  if (entry == nullptr) return false;
  const auto* list = std::get_if<ParameterValue::List>(&entry->value.data);
  return list == nullptr || !list->empty();
}

/// The file, the command line, or the parameter server: the origin without line and key.
std::string sourceOf(const ParameterEntry& entry) {
  const std::string& origin = entry.origin;
  if (isFromServer(entry)) return kParameterServer;
  const std::size_t colon = origin.rfind(':');
  if (colon == std::string::npos) return origin;
  const bool is_line = origin.find_first_not_of("0123456789", colon + 1) == std::string::npos;
  return is_line ? origin.substr(0, colon) : origin;
}

}  // namespace

void beginMounting(const ParameterEntries& entries, const std::string& section, Config* config,
                   std::vector<std::string>* faults) {
  const ParameterEntry* quaternion = lastOf(entries, "extrinsics_rotation_xyzw");
  const ParameterEntry* angles = lastOf(entries, "mounting_yaw_pitch_roll_deg");
  const ParameterEntry* axes = lastOf(entries, "extrinsics_axes");
  const bool is_given = quaternion != nullptr || axes != nullptr || isGiven(angles);
  config->has_default_mounting = !is_given && (section.empty() || config->has_default_mounting);
  if (quaternion == nullptr && angles == nullptr) return;
  config->rotation_replaces_mounting = false;
  if (quaternion == nullptr) return;
  config->mounting.reset();  // that of the top level
  if (!isGiven(angles)) return;
  if (sourceOf(*quaternion) == sourceOf(*angles)) {
    faults->push_back(angles->origin + ": " + section + "mounting_yaw_pitch_roll_deg and " + section +
                      "extrinsics_rotation_xyzw (" + quaternion->origin +
                      "): expected only one of the two, since both set the same rotation");
  }
  config->rotation_replaces_mounting = angles < quaternion;  // in the order of the entries
}

void resolveMounting(Config* config) {
  CalibrationPrior& radar = config->odometry.radar;
  radar.T_IR.l_I = config->lever_arm.value_or(Eigen::Vector3d::Zero());
  if (config->lever_arm_sigma > 0.0) {
    radar.extrinsics_translation_sigma = config->lever_arm_sigma;
  } else if (!hasLeverArm(*config)) {
    radar.extrinsics_translation_sigma = kUnmeasuredLeverArm;
  }

  Eigen::Quaterniond& q_IR = radar.T_IR.q_IR;
  if (config->mounting && !config->rotation_replaces_mounting) {
    const Eigen::Vector3d angles = kDegree * *config->mounting;
    q_IR = rotationOf({angles[0], angles[1], angles[2]});
  } else if (config->extrinsics_axes == ExtrinsicsAxes::kCloud) {
    q_IR = (q_IR * cloudFromRfu(pointCloudFormat(*config).axes)).normalized();
  }
  config->mounting.reset();
  config->rotation_replaces_mounting = false;
  config->extrinsics_axes = ExtrinsicsAxes::kRightForwardUp;
}

bool refinesHeldMounting(const Config& config) {
  return config.odometry.platform == Platform::kGroundVehicle &&
         config.estimate_extrinsics == EstimateExtrinsics::kNone;
}

void resolveEstimate(Config* config) {
  const std::vector<Config> radars = configsOfRadars(*config);
  EstimateExtrinsics estimate = config->estimate_extrinsics;
  double turn_sigma = config->extrinsics_rotation_sigma;
  if (refinesHeldMounting(*config)) {
    estimate = EstimateExtrinsics::kRotation;
    turn_sigma = std::min(turn_sigma, kConfiguredSigma);
  }
  if (!std::all_of(radars.begin(), radars.end(), hasLeverArm))
    estimate = estimatesTurn(estimate) ? EstimateExtrinsics::kPose : EstimateExtrinsics::kLeverArm;
  const auto set = [&](SmootherOptions& smoother) {
    smoother.estimate_extrinsics = estimate;
    smoother.extrinsics_rotation_sigma = turn_sigma;
  };
  set(config->odometry.smoother);
  for (Config& radar : config->radars) set(radar.odometry.smoother);
}

std::vector<std::string> mountingWarnings(const Config& config) {
  std::vector<std::string> warnings;
  for (const Config& radar : configsOfRadars(config)) {
    if (!radar.has_default_mounting || radar.extrinsics_source != ExtrinsicsSource::kParameters) continue;
    const std::string key = prefixOf(radar.radar_name);
    warnings.push_back("The configuration gives no mounting: the radar " +
                       (key.empty() ? "" : radar.radar_name + " ") +
                       "is taken to look along y of the IMU. Set " + key + "mounting_yaw_pitch_roll_deg or " +
                       key + "extrinsics_rotation_xyzw.");
  }
  return warnings;
}

}  // namespace rio_t
