#include <algorithm>
#include <boost/algorithm/string.hpp>
#include <cctype>
#include <limits>
#include <string>

#include "../parameters/parameter_list.h"
#include "../text.h"
#include "check_config.h"

namespace rio_t {
namespace {

/// The part of each topic that differs: "/radar_a/scan", "/radar_b/scan" give "a", "b".
std::vector<std::string> radarNames(const std::vector<RadarInspection>& radars) {
  std::vector<std::vector<std::string>> words;
  for (const RadarInspection& radar : radars) {
    const std::string topic = boost::algorithm::to_lower_copy(radar.topic);
    boost::algorithm::split(words.emplace_back(), topic, !boost::algorithm::is_alnum(),
                            boost::algorithm::token_compress_on);
  }
  Config any;
  const ParameterList keys = parametersOf(any);
  std::vector<std::string> names;
  for (std::size_t k = 0; k < radars.size(); ++k) {
    std::string name;
    for (const std::string& word : words[k]) {
      const bool shared = std::all_of(words.begin(), words.end(), [&](const std::vector<std::string>& other) {
        return std::find(other.begin(), other.end(), word) != other.end();
      });
      if (!shared && !word.empty()) appendItem(&name, word, "_");
    }
    // YAML must read the name as text, not as a number or a truth value.
    const bool is_text = !name.empty() && std::isalpha(static_cast<unsigned char>(name.front())) != 0 &&
                         std::holds_alternative<std::string>(parsePlainScalar(name).data);
    const bool taken = std::find(names.begin(), names.end(), name) != names.end() ||
                       keys.find(name) != nullptr || isReserved(name);
    names.push_back(!is_text || taken ? "" : name);
  }
  std::size_t number = 0;
  for (std::string& name : names)
    while (name.empty()) {
      const std::string next = "radar" + std::to_string(++number);
      if (std::find(names.begin(), names.end(), next) == names.end()) name = next;
    }
  return names;
}

/// Adds what the user has configured. The keys that say how to read a cloud are there already.
void addConfigured(const ParameterEntries& configured, ProposedConfig* config) {
  Config any;
  const ParameterList list = parametersOf(any);
  for (const ParameterEntry& entry : configured) {
    if (isCloudKey(entry.key) || isOfOneBag(entry.key)) continue;
    const auto set = [&](ProposedKeys* keys) {
      if (entry.key == "extrinsics_rotation_xyzw") keys->remove("mounting_yaw_pitch_roll_deg");
      keys->set(entry.key, entry.value, "Given by --set.");
    };
    const Parameter* const parameter = list.find(entry.key);
    if (parameter == nullptr || !parameter->description.of_radar || config->radars.empty()) {
      set(&config->top_level);
      continue;
    }
    for (auto& [name, keys] : config->radars) set(&keys);
  }
}

/// Returns the keys of a radar. A lever arm of the user replaces that of the bag. A run that holds the
/// mounting gets none, and therefore estimates it: that of the bag is too coarse to be held.
ProposedKeys keysOf(const RadarInspection& radar, const ParameterEntries& configured) {
  ProposedKeys keys = radar.keys;
  const bool holds = isConfigured("estimate_extrinsics", configured) &&
                     makeConfig(configured).estimate_extrinsics != EstimateExtrinsics::kPose;
  if (!holds && !isConfigured("extrinsics_translation", configured)) return keys;
  keys.remove("extrinsics_translation");
  keys.remove("extrinsics_translation_sigma");
  return keys;
}

/// Radars with one clock start from one offset: the one that the bag shows best.
void shareOffset(const std::vector<RadarInspection>& radars, ProposedConfig* config) {
  const ProposedKey* best = nullptr;
  double least_sigma = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < radars.size(); ++k) {
    const ProposedKey* own = config->radars[k].second.find("time_offset_initial");
    if (own == nullptr || radars[k].search.offset_sigma >= least_sigma) continue;
    best = own;
    least_sigma = radars[k].search.offset_sigma;
  }
  if (best == nullptr) return;
  const ProposedKey shared = *best;
  for (auto& [name, keys] : config->radars) keys.set(shared.key, shared.value, shared.why);
}

}  // namespace

ProposedConfig proposedConfig(const ImuInspection& imu, const std::vector<RadarInspection>& radars,
                              const ParameterEntries& configured) {
  ProposedConfig config;
  config.top_level.add(imu.keys);
  double worst = 0.0;
  bool all_observed = true;
  for (const RadarInspection& radar : radars) {
    const Eigen::Vector3d& sigma = radar.search.rotation_sigma;
    if (!radar.search.enough || sigma.maxCoeff() > kObservedTurn || radar.isSparse()) all_observed = false;
    worst = std::max(worst, sigma.maxCoeff());
  }
  config.top_level.set("estimate_extrinsics", "pose",
                       "The mounting below is coarse. The estimate starts there and refines it.");
  constexpr double kLeast = 0.05, kSafety = 3.0;  // [rad]
  if (all_observed && !isMountingConfigured(configured) &&
      kSafety * worst < SmootherOptions().extrinsics_rotation_sigma)
    config.top_level.set("extrinsics_rotation_sigma",
                         ParameterValue{rounded(std::max(kLeast, kSafety * worst), 100.0)},
                         "Standard deviation of the mounting below [rad], with a margin.");
  if (radars.size() == 1) {
    config.top_level.add(keysOf(radars.front(), configured));
    addConfigured(configured, &config);
    return config;
  }
  const std::vector<std::string> names = radarNames(radars);
  ParameterValue::List list;
  for (const std::string& name : names) list.push_back({name});
  config.top_level.set("radars", ParameterValue{list});
  for (std::size_t k = 0; k < radars.size(); ++k)
    config.radars.emplace_back(names[k], keysOf(radars[k], configured));
  if (makeConfig(configured).odometry.smoother.time_offset_shared) shareOffset(radars, &config);
  addConfigured(configured, &config);
  return config;
}

}  // namespace rio_t
