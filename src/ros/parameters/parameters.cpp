#include "rio_t/ros/parameters/parameters.h"

#include <rospack/rospack.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

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

std::string unknownKey(const ParameterEntry& entry, const std::vector<Parameter>& all) {
  const std::string looked_for = entry.key.substr(0, 100);  // the time grows with the length
  const Parameter* nearest = nullptr;
  std::size_t least = 0;
  for (const Parameter& each : all) {
    const std::size_t distance = editDistance(each.description.key, looked_for);
    if (nearest != nullptr && distance >= least) continue;
    nearest = &each;
    least = distance;
  }
  return entry.origin + ": unknown parameter \"" + entry.key + "\"; did you mean \"" +
         nearest->description.key + "\"? (config/estimator.yaml lists all)";
}

/// What single values cannot show.
std::vector<std::string> contradictions(const Config& config) {
  std::vector<std::string> faults;
  const EgoVelocityOptions& radar = config.odometry.ego_velocity;
  const SmootherOptions& smoother = config.odometry.smoother;
  if (radar.min_range >= radar.max_range) {
    faults.push_back("radar_min_range: expected less than radar_max_range (" + numberText(radar.max_range) +
                     " m), got " + numberText(radar.min_range));
  }
  if (std::abs(smoother.time_offset_initial) > smoother.max_time_offset) {
    faults.push_back("time_offset_initial: expected at most max_time_offset (" +
                     numberText(smoother.max_time_offset) + " s) in size, got " +
                     numberText(smoother.time_offset_initial));
  }
  if (config.stamp_source == StampSource::kTrigger && config.trigger_topic.empty()) {
    faults.emplace_back("trigger_topic: expected a topic, since stamp_source is trigger, got \"\"");
  }
  return faults;
}

std::string joinFaults(const std::vector<std::string>& faults) {
  if (faults.size() == 1) return faults.front();
  std::string text = std::to_string(faults.size()) + " faults in the configuration:";
  for (const std::string& fault : faults) text += "\n  " + fault;
  return text;
}

/// Folder of the package in the workspace that is sourced; empty if there is none. Asks rospack itself, since
/// ros::package complains on stderr where it finds nothing.
std::string packageFolder() {
  rospack::Rospack packages;
  packages.setQuiet(true);
  std::vector<std::string> search_path;
  std::string folder;
  if (!packages.getSearchPathFromEnv(search_path)) return "";
  packages.crawl(search_path, false);
  return packages.find("rio_t", folder) ? folder : "";
}

std::string configFolder() {
  const std::string package = packageFolder();
  if (!package.empty() && std::filesystem::is_directory(package + "/config")) return package + "/config";
  return RIO_T_SOURCE_DIR "/config";  // run from the build folder, no workspace sourced
}

}  // namespace

std::string toString(StampSource source) {
  switch (source) {
    case StampSource::kHeader:
      return "header";
    case StampSource::kTrigger:
      return "trigger";
    case StampSource::kArrival:
      return "arrival";
  }
  throw std::invalid_argument("not a StampSource");
}

ConfigError::ConfigError(std::vector<std::string> faults)
    : std::runtime_error(joinFaults(faults)), faults_(std::move(faults)) {}

PointCloudFormat pointCloudFormat(const Config& config) {
  PointCloudFormat format = pointCloudPreset(config.radar_format);
  const PointCloudOverrides& overrides = config.radar_overrides;
  if (!overrides.coordinates.empty()) format.coordinates = pointCoordinatesFromString(overrides.coordinates);
  if (!overrides.axes.empty()) format.axes = pointAxesFromString(overrides.axes);
  if (!overrides.power_unit.empty()) format.power_unit = powerUnitFromString(overrides.power_unit);
  if (!overrides.size.empty()) format.size_from_data = overrides.size == "from_data";
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

Config makeConfig(const ParameterEntries& entries) {
  Config config;
  std::vector<std::string> faults;
  const ParameterList list = parametersOf(config);
  for (const ParameterEntry& entry : entries) {
    const auto parameter = std::find_if(list.all().begin(), list.all().end(), [&](const Parameter& each) {
      return each.description.key == entry.key;
    });
    if (parameter == list.all().end()) {
      faults.push_back(unknownKey(entry, list.all()));
    } else if (!parameter->set(entry.value)) {
      const ParameterDescription& about = parameter->description;
      faults.push_back(entry.origin + ": " + entry.key + ": expected " + about.expected +
                       (about.unit.empty() ? "" : " [" + about.unit + "]") + ", got " +
                       entry.value.describe());
    }
  }
  // Judged only where each value is right by itself: otherwise a default might be blamed.
  if (faults.empty()) faults = contradictions(config);
  if (!faults.empty()) throw ConfigError(std::move(faults));
  return config;
}

std::vector<ParameterDescription> parameterDescriptions() {
  std::vector<ParameterDescription> descriptions;
  Config config;
  const ParameterList list = parametersOf(config);
  for (const Parameter& parameter : list.all()) descriptions.push_back(parameter.description);
  return descriptions;
}

std::string toYaml(const Config& config) {
  std::string yaml =
      "# Every parameter of rio_t with its default. Written by `rio_t_bag --print-config`; do not edit by "
      "hand.\n"
      "# A configuration of your own names only what differs. Unknown keys are refused.\n";
  std::string group;
  Config copy = config;  // the list wants members that it could set
  const ParameterList list = parametersOf(copy);
  for (const Parameter& parameter : list.all()) {
    const ParameterDescription& about = parameter.description;
    if (about.group != group) yaml += "\n# --- " + about.group + "\n";
    group = about.group;
    yaml += "\n# " + about.description + "\n# " + (about.unit.empty() ? "" : "[" + about.unit + "] ") +
            about.expected + "\n" + about.key + ": " + parameter.print() + "\n";
  }
  return yaml;
}

std::string findConfigFile(const std::string& name_or_path) {
  namespace fs = std::filesystem;
  if (name_or_path.find('/') != std::string::npos || fs::exists(name_or_path)) {
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
  std::string known;
  for (const std::string& name : names) known += (known.empty() ? "" : ", ") + name;
  throw std::runtime_error("configuration " + name_or_path +
                           ": no such file, and none of the package's: " + known);
}

}  // namespace rio_t
