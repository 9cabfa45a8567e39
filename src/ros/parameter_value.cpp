#include "rio_t/ros/parameter_value.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <limits>
#include <locale>
#include <map>
#include <regex>
#include <sstream>
#include <stdexcept>

namespace rio_t {
namespace {

/// Reads all of `text` as a T, with a decimal point whatever the locale of the machine.
template <typename T>
bool parseWhole(const std::string& text, T* value) {
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  stream >> *value;
  return !stream.fail() && stream.peek() == std::istringstream::traits_type::eof();
}

bool isOneOf(const std::string& text, std::initializer_list<const char*> words) {
  return std::any_of(words.begin(), words.end(), [&](const char* word) { return text == word; });
}

ParameterValue fromYaml(const YAML::Node& node) {
  if (!node.IsDefined() || node.IsNull()) return {};
  if (node.IsScalar()) {
    if (node.Tag() == "!") return {node.Scalar()};  // quoted: text, whatever it looks like
    return parsePlainScalar(node.Scalar());
  }
  if (node.IsMap()) return {ParameterValue::Map{}};
  ParameterValue::List list;
  for (const auto& element : node) list.push_back(fromYaml(element));
  return {std::move(list)};
}

}  // namespace

std::string ParameterValue::describe() const {
  struct Describe {
    std::string operator()(std::monostate) const { return "nothing"; }
    std::string operator()(bool value) const { return value ? "true" : "false"; }
    std::string operator()(std::int64_t value) const { return std::to_string(value); }
    std::string operator()(double value) const {
      std::ostringstream text;
      text.imbue(std::locale::classic());
      text.precision(12);
      text << value;
      return text.str();
    }
    std::string operator()(const std::string& value) const { return '"' + value + '"'; }
    std::string operator()(const List& list) const {
      std::string text = "[";
      for (const ParameterValue& value : list) text += (text.size() > 1 ? ", " : "") + value.describe();
      return text + "]";
    }
    std::string operator()(Map) const { return "nested keys"; }
  };
  return std::visit(Describe{}, data);
}

ParameterValue parsePlainScalar(const std::string& text) {
  // The words of YAML 1.1, since that is what the ROS parameter server reads.
  if (isOneOf(text, {"", "~", "null", "Null", "NULL"})) return {};
  if (isOneOf(text, {"true", "True", "TRUE", "yes", "Yes", "YES", "on", "On", "ON"})) return {true};
  if (isOneOf(text, {"false", "False", "FALSE", "no", "No", "NO", "off", "Off", "OFF"})) return {false};
  if (isOneOf(text, {".nan", ".NaN", ".NAN", "nan", "NaN"}))
    return {std::numeric_limits<double>::quiet_NaN()};
  if (isOneOf(text, {".inf", ".Inf", ".INF", "+.inf", "inf"}))
    return {std::numeric_limits<double>::infinity()};
  if (isOneOf(text, {"-.inf", "-.Inf", "-.INF", "-inf"})) return {-std::numeric_limits<double>::infinity()};

  static const std::regex integer("[-+]?[0-9]+");
  static const std::regex number("[-+]?([0-9]+\\.?[0-9]*|\\.[0-9]+)([eE][-+]?[0-9]+)?");
  std::int64_t whole = 0;
  if (std::regex_match(text, integer) && parseWhole(text, &whole)) return {whole};
  double real = 0.0;
  if (std::regex_match(text, number)) {
    if (parseWhole(text, &real)) return {real};
    return {std::numeric_limits<double>::infinity()};  // 1e999
  }
  return {text};
}

ParameterEntries readParameterFile(const std::string& path) {
  if (std::filesystem::is_directory(path)) {
    throw std::runtime_error(path + ": expected a YAML file with one `key: value` a line, this is a folder");
  }
  std::ifstream file(path);
  if (!file)
    throw std::runtime_error(path + ": cannot be read; expected a YAML file with one `key: value` a line");

  YAML::Node root;
  try {
    root = YAML::Load(file);
  } catch (const YAML::Exception& error) {
    throw std::runtime_error(path + ":" + std::to_string(error.mark.line + 1) + ": not YAML (" + error.msg +
                             "); expected one `key: value` a line");
  }
  if (!root.IsDefined() || root.IsNull()) return {};
  if (!root.IsMap()) throw std::runtime_error(path + ":1: expected one `key: value` a line");

  ParameterEntries entries;
  std::map<std::string, int> line_of;
  for (const auto& item : root) {
    const int line = item.first.Mark().line + 1;
    const std::string origin = path + ":" + std::to_string(line);
    if (!item.first.IsScalar())
      throw std::runtime_error(origin + ": expected `key: value`, the key is no text");
    const std::string key = item.first.Scalar();
    const auto [first, is_new] = line_of.emplace(key, line);
    if (!is_new) {
      throw std::runtime_error(origin + ": " + key + ": expected each key once, it stands in line " +
                               std::to_string(first->second) + " too");
    }
    entries.push_back({key, fromYaml(item.second), origin});
  }
  return entries;
}

ParameterEntry parseAssignment(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw std::invalid_argument("--set " + text + ": expected key=value");
  }
  try {
    return {text.substr(0, equals), fromYaml(YAML::Load(text.substr(equals + 1))), "--set"};
  } catch (const YAML::Exception& error) {
    throw std::invalid_argument("--set " + text + ": the value is not YAML (" + error.msg + ")");
  }
}

}  // namespace rio_t
