#include <algorithm>
#include <map>
#include <utility>

#include "../text.h"
#include "mounting_parameters.h"
#include "parameter_list.h"
#include "rio_t/ros/parameters/parameters.h"

namespace rio_t {
namespace {

/// Edits (insert, remove, replace a letter) that turn `a` into `b`: Levenshtein's distance, by rows.
std::size_t editDistance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

/// `section`: empty, or that of a radar as "left/".
std::string unknownKey(const ParameterEntry& entry, const std::string& section, const ParameterList& list) {
  const std::string looked_for = entry.key.substr(0, 100);  // the time grows with the length
  const Parameter* nearest = nullptr;
  std::size_t least = 0;
  for (const Parameter& each : list.all()) {
    if (!section.empty() && !each.description.of_radar) continue;
    const std::size_t distance = editDistance(each.description.key, looked_for);
    if (nearest != nullptr && distance >= least) continue;
    nearest = &each;
    least = distance;
  }
  const bool is_near = least <= std::max<std::size_t>(2, looked_for.size() / 3);
  return entry.origin + ": unknown parameter \"" + section + entry.key + "\"" +
         (is_near ? "; did you mean \"" + section + nearest->description.key + "\"?" : std::string()) +
         " (config/estimator.yaml lists all)";
}

/// Sets the parameter of that key, or adds to `faults`.
void setParameter(const ParameterEntry& entry, const std::string& section, const ParameterList& list,
                  std::vector<std::string>* faults) {
  const Parameter* parameter = list.find(entry.key);
  if (parameter == nullptr) {
    faults->push_back(unknownKey(entry, section, list));
    return;
  }
  const ParameterDescription& about = parameter->description;
  if (!section.empty() && !about.of_radar) {
    faults->push_back(entry.origin + ": " + section + entry.key + ": " + entry.key +
                      " holds for all radars; expected it at the top level, not in the section of a radar");
  } else if (!parameter->set(entry.value)) {
    faults->push_back(entry.origin + ": " + section + entry.key + ": expected " + about.expected +
                      (about.unit.empty() ? "" : " [" + about.unit + "]") + ", got " +
                      entry.value.describe());
  }
}

/// "left, right"
std::string namesOf(const std::vector<Config>& radars) {
  std::string names;
  for (const Config& radar : radars) appendItem(&names, radar.radar_name);
  return names;
}

bool isRadar(const std::string& name, const std::vector<Config>& radars) {
  return std::any_of(radars.begin(), radars.end(),
                     [&](const Config& each) { return each.radar_name == name; });
}

/// Sets the values of the top level; `radars` gets only names.
void setTopLevel(const ParameterEntries& entries, const ParameterList& list,
                 const std::vector<Config>& radars, std::vector<std::string>* faults) {
  // `radars` comes first, since it says which other keys there are.
  for (const ParameterEntry& entry : entries) {
    if (entry.key == "radars") setParameter(entry, "", list, faults);
  }
  for (const ParameterEntry& entry : entries) {
    if (entry.key == "radars") continue;
    if (list.find(entry.key) != nullptr || !isRadar(entry.key, radars)) {
      setParameter(entry, "", list, faults);
    } else if (!std::holds_alternative<std::monostate>(entry.value.data)) {  // `left:` and no more
      faults->push_back(entry.origin + ": " + entry.key + ": expected nested keys, as " + entry.key +
                        " is the name of a radar, got " + entry.value.describe());
    }
  }
  for (const Config& radar : radars) {
    if (list.find(radar.radar_name) == nullptr && !isReserved(radar.radar_name)) continue;
    faults->push_back("radars: expected names that are no parameters, got \"" + radar.radar_name + "\"");
  }
  // `radar_doppler_step_from_left` must belong to one radar, and so must
  // `final_extrinsics_rotation_sigma_left`.
  for (const Config& radar : radars) {
    for (const char* part : {"from_", "sigma_"}) {
      if (!isRadar(part + radar.radar_name, radars)) continue;
      faults->push_back("radars: " + radar.radar_name + " and " + part + radar.radar_name +
                        " would share keys of summary.yaml; expected another name");
    }
  }
}

/// Sets the values in the section of a radar.
void setSection(const Section& section, Config* radar, std::vector<std::string>* faults) {
  beginMounting(section.entries, prefixOf(radar->radar_name), radar, faults);
  const ParameterList list = parametersOf(*radar);
  for (const ParameterEntry& entry : section.entries)
    setParameter(entry, prefixOf(radar->radar_name), list, faults);
}

/// Whether `radars` had the name before a later entry took it out, as `--set radars=[left]` does.
bool wasRadar(const std::string& name, const ParameterEntries& top_level) {
  return std::any_of(top_level.begin(), top_level.end(), [&](const ParameterEntry& entry) {
    const auto* names = std::get_if<ParameterValue::List>(&entry.value.data);
    return entry.key == "radars" && names != nullptr &&
           std::any_of(names->begin(), names->end(), [&](const ParameterValue& each) {
             const auto* text = std::get_if<std::string>(&each.data);
             return text != nullptr && *text == name;
           });
  });
}

/// Refuses a value of the command line, or of the parameter server beside a file, if every radar overrides it
/// in its section: it would silently do nothing.
void refuseHidden(const SortedEntries& sorted, const std::vector<Config>& radars,
                  std::vector<std::string>* faults) {
  // Both keys give the rotation of the radar, and the later one counts.
  const auto isTurn = [](const std::string& key) {
    return key == "mounting_yaw_pitch_roll_deg" || key == "extrinsics_rotation_xyzw";
  };
  const auto hides = [&](const Config& radar, const ParameterEntry& entry) {
    const auto section = sorted.sections.find(radar.radar_name);
    if (section == sorted.sections.end()) return false;
    const ParameterEntries& own = section->second.entries;
    return std::any_of(own.begin(), own.end(), [&](const ParameterEntry& each) {
      return (each.key == entry.key || (isTurn(each.key) && isTurn(entry.key))) &&
             (entry.origin == kCommandLine || !isFromServer(each));
    });
  };
  for (const ParameterEntry& entry : sorted.top_level) {
    const bool is_hidden =
        !radars.empty() &&
        std::all_of(radars.begin(), radars.end(), [&](const Config& radar) { return hides(radar, entry); });
    if (!is_hidden || (entry.origin != kCommandLine && !isFromServer(entry))) continue;
    std::string expected;
    for (const Config& radar : radars) appendItem(&expected, radar.radar_name + "/" + entry.key);
    faults->push_back(entry.origin + ": " + entry.key +
                      " would do nothing, since each radar has its own; expected " + expected);
  }
}

/// Completes `radars`, whose names are known, from the top level and the sections.
void setRadars(const SortedEntries& sorted, const Config& top_level, std::vector<Config>* radars,
               std::vector<std::string>* faults) {
  const std::map<std::string, Section>& sections = sorted.sections;
  for (const auto& [name, section] : sections) {
    if (isRadar(name, *radars)) continue;
    if (wasRadar(name, sorted.top_level)) {
      Config unused = withoutSection(top_level, name);
      setSection(section, &unused, faults);
      continue;
    }
    faults->push_back(section.origin + ": unknown parameter \"" + name +
                      "\" with keys of its own; expected the name of a radar, and `radars` has " +
                      (radars->empty() ? "none" : namesOf(*radars)));
  }
  for (Config& radar : *radars) {
    radar = withoutSection(top_level, radar.radar_name);
    const auto section = sections.find(radar.radar_name);
    if (section != sections.end()) setSection(section->second, &radar, faults);
  }
}

std::string joinFaults(const std::vector<std::string>& faults) {
  if (faults.size() == 1) return faults.front();
  std::string text = std::to_string(faults.size()) + " faults in the configuration:";
  for (const std::string& fault : faults) text += "\n  " + fault;
  return text;
}

}  // namespace

SortedEntries sortedEntries(const ParameterEntries& entries, const ParameterList& list) {
  SortedEntries result;
  for (const ParameterEntry& entry : entries) {
    const std::size_t slash = entry.key.find('/');
    const auto* nested = std::get_if<ParameterValue::Map>(&entry.value.data);
    if (slash != std::string::npos) {
      Section& section =
          result.sections.try_emplace(entry.key.substr(0, slash), Section{entry.origin, {}}).first->second;
      section.entries.push_back({entry.key.substr(slash + 1), entry.value, entry.origin});
    } else if (nested != nullptr && list.find(entry.key) == nullptr) {
      Section& section = result.sections.try_emplace(entry.key, Section{entry.origin, {}}).first->second;
      section.entries.insert(section.entries.end(), nested->begin(), nested->end());
    } else {
      result.top_level.push_back(entry);
    }
  }
  return result;
}

Config withoutSection(const Config& top_level, const std::string& name) {
  Config config = top_level;
  config.radars.clear();
  config.radar_name = name;
  config.radar_frame += "_" + name;
  return config;
}

ConfigError::ConfigError(std::vector<std::string> faults)
    : std::runtime_error(joinFaults(faults)), faults_(std::move(faults)) {}

Config makeConfig(const ParameterEntries& entries) {
  Config config;
  std::vector<std::string> faults;
  const ParameterList list = parametersOf(config);
  const SortedEntries sorted = sortedEntries(entries, list);
  beginMounting(sorted.top_level, "", &config, &faults);
  setTopLevel(sorted.top_level, list, config.radars, &faults);
  refuseHidden(sorted, config.radars, &faults);
  const Config top_level = config;
  setRadars(sorted, top_level, &config.radars, &faults);
  config.odometry.use_barometer = !config.barometer_topic.empty();
  resolveMounting(&config);
  for (Config& radar : config.radars) {
    resolveMounting(&radar);
    config.odometry.radars.push_back(radar.odometry.radar);
  }
  resolveEstimate(&config);
  // Only if each value is valid by itself: otherwise the fault might name a default.
  if (faults.empty()) faults = contradictions(config);
  if (!faults.empty()) throw ConfigError(std::move(faults));
  return config;
}

Config withParameters(const Config& config, const ParameterEntries& entries) {
  Config changed = config;
  std::vector<std::string> faults;
  const auto set = [&](Config& each, std::vector<std::string>* faults_of_each) {
    const ParameterList list = parametersOf(each);
    for (const ParameterEntry& entry : entries) setParameter(entry, "", list, faults_of_each);
  };
  set(changed, &faults);
  std::vector<std::string> same_faults;
  for (Config& radar : changed.radars) set(radar, &same_faults);
  if (faults.empty()) faults = contradictions(changed);
  if (!faults.empty()) throw ConfigError(std::move(faults));
  return changed;
}

ParameterValue parameterValue(const Config& config, const std::string& key) {
  Config copy = config;  // a list needs members that it could set
  const ParameterList list = parametersOf(copy);
  const Parameter* parameter = list.find(key);
  if (parameter == nullptr) throw std::invalid_argument("no parameter \"" + key + "\"");
  return parameter->get();
}

const std::vector<std::string>& liveKeys() {
  static const std::vector<std::string> keys = {"imu_accel_noise_density",
                                                "imu_gyro_noise_density",
                                                "imu_accel_random_walk",
                                                "imu_gyro_random_walk",
                                                "imu_gyro_scale_error",
                                                "innovation_gate",
                                                "innovation_model_error",
                                                "innovation_gate_timeout",
                                                "odom_rate",
                                                "tf_rate",
                                                "path_max_poses",
                                                "correct_stamps"};
  return keys;
}

}  // namespace rio_t
