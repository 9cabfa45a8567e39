#include "inspect_keys.h"

#include <algorithm>
#include <cmath>

namespace rio_t {

void ProposedKeys::set(const std::string& key, ParameterValue value, const std::string& why) {
  const auto same =
      std::find_if(keys_.begin(), keys_.end(), [&](const ProposedKey& each) { return each.key == key; });
  ProposedKey& place = same == keys_.end() ? keys_.emplace_back() : *same;
  place = {key, std::move(value), why};
}

void ProposedKeys::set(const std::string& key, const std::string& text, const std::string& why) {
  set(key, ParameterValue{text}, why);
}

void ProposedKeys::add(const ProposedKeys& other) {
  for (const ProposedKey& key : other.all()) set(key.key, key.value, key.why);
}

void ProposedKeys::remove(const std::string& key) {
  keys_.erase(
      std::remove_if(keys_.begin(), keys_.end(), [&](const ProposedKey& each) { return each.key == key; }),
      keys_.end());
}

const ProposedKey* ProposedKeys::find(const std::string& key) const {
  const auto same =
      std::find_if(keys_.begin(), keys_.end(), [&](const ProposedKey& each) { return each.key == key; });
  return same == keys_.end() ? nullptr : &*same;
}

bool isConfigured(const std::string& key, const ParameterEntries& configured) {
  return std::any_of(configured.begin(), configured.end(),
                     [&](const ParameterEntry& entry) { return entry.key == key; });
}

bool isOfOneBag(const std::string& key) {
  return key == "bag_start" || key == "bag_duration" || key == "ground_truth";
}

double rounded(double value, double per) { return std::round(value * per) / per + 0.0; }

std::string commented(const std::string& text, const std::string& indent) {
  std::string result;
  bool starts = true;
  for (const char c : text) {
    if (starts) result += indent + "# ";
    starts = c == '\n';
    const bool is_control = (c >= 0 && c < ' ') || c == '\x7f';
    result += is_control && c != '\n' ? '?' : c;
  }
  return result;
}

std::string toYaml(const ProposedKeys& keys, const std::string& indent) {
  std::string text;
  for (const ProposedKey& key : keys.all()) {
    if (!key.why.empty()) text += commented(key.why + "\n", "");
    text += indent + key.key + ": " + key.value.yaml() + "\n";
  }
  return text;
}

std::string toYaml(const ProposedConfig& proposed, const std::string& header) {
  ProposedKeys differing;
  for (const ProposedKey& key : proposed.top_level.all()) {
    if (parameterValue(Config(), key.key).yaml() != key.value.yaml())
      differing.set(key.key, key.value, key.why);
  }
  std::string text = commented(header + "\n", "") + "\n" + toYaml(differing, "");
  // The top level may differ from the defaults, so a section names all of its keys.
  for (const auto& [name, keys] : proposed.radars) text += name + ":\n" + toYaml(keys, "  ");
  return text;
}

Config readBack(const std::string& yaml) {
  return makeConfig(readParameters(yaml, "proposed configuration"));
}

}  // namespace rio_t
