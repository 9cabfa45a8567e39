#include "mounting_parameters.h"

#include <variant>

namespace rio_t {
namespace {

const ParameterEntry* lastOf(const ParameterEntries& entries, const std::string& key) {
  const ParameterEntry* last = nullptr;
  for (const ParameterEntry& entry : entries) {
    if (entry.key == key) last = &entry;
  }
  return last;
}

/// `[]` stands for "not told".
bool tells(const ParameterEntry* entry) {
  if (entry == nullptr) return false;
  const auto* list = std::get_if<ParameterValue::List>(&entry->value.data);
  return list == nullptr || !list->empty();
}

}  // namespace

void beginMounting(const ParameterEntries& entries, const std::string& section, Config* config,
                   std::vector<std::string>* faults) {
  const ParameterEntry* quaternion = lastOf(entries, "extrinsics_rotation_xyzw");
  const ParameterEntry* angles = lastOf(entries, "mounting_yaw_pitch_roll_deg");
  if (quaternion != nullptr && tells(angles)) {
    faults->push_back(angles->origin + ": " + section + "mounting_yaw_pitch_roll_deg and " + section +
                      "extrinsics_rotation_xyzw (" + quaternion->origin +
                      "): expected only one of the two, since both set the same rotation");
  }
  if (quaternion != nullptr) config->mounting.reset();
}

void resolveMounting(Config* config) {
  Eigen::Quaterniond& q_IR = config->odometry.T_IR.q_IR;
  if (config->mounting) {
    q_IR = rotationOf(*config->mounting);
  } else if (config->extrinsics_axes == ExtrinsicsAxes::kCloud) {
    q_IR = (q_IR * cloudFromRfu(pointCloudFormat(*config).axes)).normalized();
  }
  config->mounting.reset();
  config->extrinsics_axes = ExtrinsicsAxes::kRightForwardUp;
}

}  // namespace rio_t
