#include "inspect_keys.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <sstream>

#include "rio_t/ros/bag/run_output.h"

namespace rio_t {
namespace {

/// Whether the default of the key is this value.
bool isDefault(const ProposedKey& key) {
  if (key.is_list) return false;
  static const ParameterEntries defaults = [] {
    std::istringstream yaml(toYaml(Config{}));
    return readParameters(yaml, "defaults");
  }();
  const auto found = std::find_if(defaults.begin(), defaults.end(),
                                  [&](const ParameterEntry& entry) { return entry.key == key.key; });
  if (found == defaults.end()) return false;
  const std::string same = parseAssignment(key.key + "=" + key.values.front()).value.yaml();
  return found->value.yaml() == same;
}

void emit(const ProposedKeys& keys, bool with_defaults, YAML::Emitter* out) {
  for (const ProposedKey& key : keys.all()) {
    if (!with_defaults && isDefault(key)) continue;
    if (!key.why.empty()) *out << YAML::Newline << YAML::Comment(key.why) << YAML::Newline;
    *out << YAML::Key << key.key << YAML::Value;
    if (!key.is_list) {
      *out << key.values.front();
      continue;
    }
    *out << YAML::Flow << YAML::BeginSeq;
    for (const std::string& value : key.values) *out << value;
    *out << YAML::EndSeq;
  }
}

}  // namespace

void ProposedKeys::put(ProposedKey key) {
  const auto same =
      std::find_if(keys_.begin(), keys_.end(), [&](const ProposedKey& each) { return each.key == key.key; });
  if (same == keys_.end()) {
    keys_.push_back(std::move(key));
  } else {
    *same = std::move(key);
  }
}

void ProposedKeys::set(const std::string& key, const std::string& value, const std::string& why) {
  put({key, {value}, false, why});
}

void ProposedKeys::setList(const std::string& key, const std::vector<std::string>& values,
                           const std::string& why) {
  put({key, values, true, why});
}

void ProposedKeys::add(const ProposedKeys& other) {
  for (const ProposedKey& key : other.all()) put(key);
}

void ProposedKeys::remove(const std::string& key) {
  keys_.erase(
      std::remove_if(keys_.begin(), keys_.end(), [&](const ProposedKey& each) { return each.key == key; }),
      keys_.end());
}

std::string toYaml(const ProposedConfig& proposed, const std::string& header) {
  YAML::Emitter out;
  out << YAML::Comment(header) << YAML::Newline << YAML::BeginMap;
  emit(proposed.top_level, false, &out);
  for (const auto& [name, keys] : proposed.radars) {
    out << YAML::Newline << YAML::Key << name << YAML::Value << YAML::BeginMap;
    emit(keys, true, &out);  // the top level may differ from the defaults
    out << YAML::EndMap;
  }
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

Config readBack(const std::string& yaml) {
  std::istringstream stream(yaml);
  return makeConfig(readParameters(stream, "proposed configuration"));
}

}  // namespace rio_t
