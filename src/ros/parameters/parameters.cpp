#include "rio_t/ros/parameters/parameters.h"

#include <dlfcn.h>

#include <algorithm>
#include <boost/algorithm/string/join.hpp>
#include <cmath>
#include <filesystem>
#include <map>
#include <utility>

#include "../text.h"
#include "mounting_parameters.h"
#include "parameter_list.h"

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

const Parameter* find(const ParameterList& list, const std::string& key) {
  const auto found = std::find_if(list.all().begin(), list.all().end(),
                                  [&](const Parameter& each) { return each.description.key == key; });
  return found == list.all().end() ? nullptr : &*found;
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

/// Sets the parameter of that key; what is wrong goes into `faults`.
void setParameter(const ParameterEntry& entry, const std::string& section, const ParameterList& list,
                  std::vector<std::string>* faults) {
  const Parameter* parameter = find(list, entry.key);
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

RadarOptions radarOptions(const Config& config) {
  const OdometryOptions& odometry = config.odometry;
  return {odometry.T_IR, odometry.ego_velocity, odometry.smoother.time_offset_initial,
          odometry.smoother.time_offset_sigma};
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

/// The values of the top level, `radars` with no more than their names; what is wrong goes into `faults`.
void setTopLevel(const ParameterEntries& entries, const ParameterList& list,
                 const std::vector<Config>& radars, std::vector<std::string>* faults) {
  // First, since it says which other keys there are.
  for (const ParameterEntry& entry : entries) {
    if (entry.key == "radars") setParameter(entry, "", list, faults);
  }
  for (const ParameterEntry& entry : entries) {
    if (entry.key == "radars") continue;
    if (find(list, entry.key) != nullptr || !isRadar(entry.key, radars)) {
      setParameter(entry, "", list, faults);
    } else if (!std::holds_alternative<std::monostate>(entry.value.data)) {  // `left:` and no more
      faults->push_back(entry.origin + ": " + entry.key + ": expected nested keys, as " + entry.key +
                        " is the name of a radar, got " + entry.value.describe());
    }
  }
  for (const Config& radar : radars) {
    if (find(list, radar.radar_name) == nullptr && !isReserved(radar.radar_name)) continue;
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

/// Sets what stands in the section of a radar.
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

/// Refuses a value on the command line that every radar overrides in its section: it would silently do
/// nothing.
void refuseHidden(const SortedEntries& sorted, const std::vector<Config>& radars,
                  std::vector<std::string>* faults) {
  // Both say how the radar is turned, and the later one holds.
  const auto isTurn = [](const std::string& key) {
    return key == "mounting_yaw_pitch_roll_deg" || key == "extrinsics_rotation_xyzw";
  };
  const auto hides = [&](const Config& radar, const std::string& key) {
    const auto section = sorted.sections.find(radar.radar_name);
    if (section == sorted.sections.end()) return false;
    const ParameterEntries& own = section->second.entries;
    return std::any_of(own.begin(), own.end(), [&](const ParameterEntry& each) {
      return each.key == key || (isTurn(each.key) && isTurn(key));
    });
  };
  for (const ParameterEntry& entry : sorted.top_level) {
    const bool is_hidden =
        !radars.empty() && std::all_of(radars.begin(), radars.end(),
                                       [&](const Config& radar) { return hides(radar, entry.key); });
    if (!is_hidden || entry.origin != kCommandLine) continue;
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

/// What single values of one radar cannot show.
void addContradictions(const Config& config, std::vector<std::string>* faults) {
  const std::string section = prefixOf(config.radar_name);
  if (config.odom_frame == config.base_link_frame)
    faults->push_back("odom_frame: expected another frame than base_link_frame, got \"" + config.odom_frame +
                      "\" for both");
  if (config.radar_frame == config.base_link_frame || config.radar_frame == config.odom_frame)
    faults->push_back(section + "radar_frame: expected a frame of its own, got \"" + config.radar_frame +
                      "\", which is base_link_frame or odom_frame");
  const EgoVelocityOptions& radar = config.odometry.ego_velocity;
  const SmootherOptions& smoother = config.odometry.smoother;
  if (radar.min_range >= radar.max_range) {
    faults->push_back(section + "radar_min_range: expected less than radar_max_range (" +
                      numberText(radar.max_range) + " m), got " + numberText(radar.min_range));
  }
  if (std::abs(smoother.time_offset_initial) > smoother.max_time_offset) {
    faults->push_back(section + "time_offset_initial: expected at most max_time_offset (" +
                      numberText(smoother.max_time_offset) + " s) in size, got " +
                      numberText(smoother.time_offset_initial));
  }
  if (config.stamp_source == StampSource::kTrigger && config.trigger_topic.empty())
    faults->push_back(section + "trigger_topic: expected a topic, since stamp_source is trigger, got \"\"");
}

/// A topic has one type.
void addSharedTopics(const Config& config, std::vector<std::string>* faults) {
  const std::vector<InputTopic> inputs = inputTopics(config);
  for (std::size_t k = 0; k < inputs.size(); ++k)
    for (std::size_t other = 0; other < k; ++other)
      if (inputs[k].topic == inputs[other].topic && inputs[k].type != inputs[other].type)
        faults->push_back(inputs[k].key + ": expected another topic than " + inputs[other].key + ", got \"" +
                          inputs[k].topic + "\" for both");
}

/// What one radar cannot show.
void addContradictionsAmong(const std::vector<Config>& radars, std::vector<std::string>* faults) {
  for (std::size_t k = 0; k < radars.size(); ++k) {
    const Config& radar = radars[k];
    for (std::size_t other = 0; other < k; ++other) {
      const auto same = [&](const char* key, const std::string& value) {
        faults->push_back(radar.radar_name + "/" + key + ": expected another than that of " +
                          radars[other].radar_name + ", got \"" + value + "\" for both");
      };
      if (radar.radar_topic == radars[other].radar_topic) same("radar_topic", radar.radar_topic);
      if (radar.radar_frame == radars[other].radar_frame) same("radar_frame", radar.radar_frame);
    }
    const SmootherOptions& first = radars.front().odometry.smoother;
    const SmootherOptions& smoother = radar.odometry.smoother;
    if (!smoother.time_offset_shared) continue;
    if (smoother.time_offset_initial != first.time_offset_initial ||
        smoother.time_offset_sigma != first.time_offset_sigma) {
      faults->push_back(radar.radar_name +
                        "/: expected time_offset_initial and time_offset_sigma as those of " +
                        radars.front().radar_name + ", since time_offset_shared is true");
    }
  }
}

std::vector<std::string> contradictions(const Config& config) {
  std::vector<std::string> faults;
  for (const Config& radar : configsOfRadars(config)) addContradictions(radar, &faults);
  addSharedTopics(config, &faults);
  addContradictionsAmong(config.radars, &faults);
  return faults;
}

std::string joinFaults(const std::vector<std::string>& faults) {
  if (faults.size() == 1) return faults.front();
  std::string text = std::to_string(faults.size()) + " faults in the configuration:";
  for (const std::string& fault : faults) text += "\n  " + fault;
  return text;
}

/// The folder of the configurations that came with this library: PREFIX/lib/librio_t_ros.so and
/// PREFIX/share/rio_t/config, in the install space as in the devel space. No workspace needs to be sourced.
std::string configFolder() {
  static const char in_this_library = 0;
  Dl_info library;
  if (dladdr(&in_this_library, &library) == 0) return "";
  const auto path = std::filesystem::canonical(library.dli_fname);
  return (path.parent_path().parent_path() / "share/rio_t/config").string();
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
    } else if (nested != nullptr && find(list, entry.key) == nullptr) {
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
  config.radar_frame = "rio_t_radar_" + name;
  return config;
}

std::string toString(StampSource source) {
  return source == StampSource::kHeader ? "header" : source == StampSource::kTrigger ? "trigger" : "arrival";
}

ConfigError::ConfigError(std::vector<std::string> faults)
    : std::runtime_error(joinFaults(faults)), faults_(std::move(faults)) {}

PointCloudFormat pointCloudFormat(const Config& config) {
  PointCloudFormat format = pointCloudPreset(config.radar_format);
  const PointCloudOverrides& overrides = config.radar_overrides;
  format.coordinates = overrides.coordinates.value_or(format.coordinates);
  format.axes = overrides.axes.value_or(format.axes);
  format.power_unit = overrides.power_unit.value_or(format.power_unit);
  format.size_from_data = overrides.size_from_data.value_or(format.size_from_data);
  if (overrides.doppler_sign != 0) format.doppler_sign = overrides.doppler_sign;
  const std::pair<const std::string*, std::string*> names[] = {
      {&overrides.x, &format.x},
      {&overrides.y, &format.y},
      {&overrides.z, &format.z},
      {&overrides.azimuth, &format.azimuth},
      {&overrides.elevation, &format.elevation},
      {&overrides.range, &format.range},
      {&overrides.doppler, &format.doppler},
      {&overrides.power, &format.power},
  };
  for (const auto& [from, to] : names) {
    if (!from->empty()) *to = *from;
  }
  return format;
}

std::vector<Config> configsOfRadars(const Config& config) {
  return config.radars.empty() ? std::vector<Config>{config} : config.radars;
}

Config withTopics(Config config, const TopicResolver& resolve) {
  const std::string section = prefixOf(config.radar_name);
  const std::pair<std::string, std::string*> topics[] = {
      {"imu_topic", &config.imu_topic},
      {"barometer_topic", &config.barometer_topic},
      {section + "radar_topic", &config.radar_topic},
      {section + "trigger_topic", &config.trigger_topic},
      {"ground_truth_topic", &config.ground_truth_topic},
  };
  for (const auto& [key, topic] : topics)
    if (!topic->empty()) *topic = resolve(key, *topic);
  for (Config& radar : config.radars) radar = withTopics(radar, resolve);
  return config;
}

std::vector<InputTopic> inputTopics(const Config& config) {
  std::vector<InputTopic> topics = {{"imu_topic", config.imu_topic, "sensor_msgs/Imu"}};
  if (!config.barometer_topic.empty())
    topics.push_back({"barometer_topic", config.barometer_topic, "sensor_msgs/FluidPressure"});
  for (const Config& radar : configsOfRadars(config)) {
    const std::string section = prefixOf(radar.radar_name);
    topics.push_back({section + "radar_topic", radar.radar_topic, "sensor_msgs/PointCloud2"});
    if (radar.stamp_source == StampSource::kTrigger)
      topics.push_back({section + "trigger_topic", radar.trigger_topic, "std_msgs/Header"});
  }
  return topics;
}

std::string withoutSlash(const std::string& frame) {
  return !frame.empty() && frame.front() == '/' ? frame.substr(1) : frame;
}

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
    config.odometry.radars.push_back(radarOptions(radar));
  }
  // Judged only where each value is right by itself: otherwise a default might be blamed.
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
  Config copy = config;  // the list wants members that it could set
  const ParameterList list = parametersOf(copy);
  const Parameter* parameter = find(list, key);
  if (parameter == nullptr) throw std::invalid_argument("no parameter \"" + key + "\"");
  return parameter->get();
}

const std::vector<std::string>& liveKeys() {
  static const std::vector<std::string> keys = {"imu_accel_noise_density",
                                                "imu_gyro_noise_density",
                                                "imu_accel_random_walk",
                                                "imu_gyro_random_walk",
                                                "innovation_gate",
                                                "innovation_model_error",
                                                "innovation_gate_timeout",
                                                "odom_rate",
                                                "tf_rate",
                                                "path_max_poses",
                                                "correct_stamps"};
  return keys;
}

std::string findConfigFile(const std::string& name_or_path) {
  namespace fs = std::filesystem;
  // A folder of that name says nothing: `--config irs` works beside a folder with the results for irs.
  if (name_or_path.find('/') != std::string::npos || fs::is_regular_file(name_or_path)) {
    if (!fs::exists(name_or_path))
      throw std::runtime_error("configuration " + name_or_path + ": no such file");
    return name_or_path;
  }
  const std::string folder = configFolder();
  for (const char* extension : {"", ".yaml"}) {
    std::string path = folder + "/" + name_or_path + extension;
    if (fs::is_regular_file(path)) return path;
  }
  std::vector<std::string> names;
  if (fs::is_directory(folder)) {
    for (const auto& file : fs::directory_iterator(folder)) {
      if (file.path().extension() == ".yaml") names.push_back(file.path().stem().string());
    }
  }
  std::sort(names.begin(), names.end());
  throw std::runtime_error(
      "configuration " + name_or_path +
      ": no such file; configurations of the package: " + boost::algorithm::join(names, ", "));
}

}  // namespace rio_t
