#include "rio_t/ros/parameters/ros_parameters.h"

#include <ros/console.h>
#include <ros/param.h>

#include <limits>
#include <stdexcept>

#include "parameter_list.h"

namespace rio_t {
namespace {

struct ToXmlRpc {
  XmlRpc::XmlRpcValue operator()(std::monostate) const { return {}; }
  XmlRpc::XmlRpcValue operator()(bool value) const { return {value}; }
  XmlRpc::XmlRpcValue operator()(double value) const { return {value}; }
  XmlRpc::XmlRpcValue operator()(const std::string& value) const { return {value}; }
  XmlRpc::XmlRpcValue operator()(std::int64_t value) const {
    using Limits = std::numeric_limits<int>;
    if (value < Limits::min() || value > Limits::max()) return {static_cast<double>(value)};
    return {static_cast<int>(value)};
  }
  XmlRpc::XmlRpcValue operator()(const ParameterValue::List& list) const {
    XmlRpc::XmlRpcValue result;
    result.setSize(static_cast<int>(list.size()));
    for (std::size_t k = 0; k < list.size(); ++k)
      result[static_cast<int>(k)] = std::visit(*this, list[k].data);
    return result;
  }
  XmlRpc::XmlRpcValue operator()(const ParameterValue::Map& entries) const { return toXmlRpc(entries); }
};

/// Returns the value of a key. `rosrun rio_t rio_t_node _key:=[0,0,180]` makes a text of the list.
ParameterValue toValueOf(const std::string& key, XmlRpc::XmlRpcValue& value) {
  ParameterValue result = toParameterValue(value);
  const auto* text = std::get_if<std::string>(&result.data);
  if (text == nullptr || text->empty() || text->front() != '[') return result;
  try {
    const bool takes_list = std::holds_alternative<ParameterValue::List>(parameterValue(Config(), key).data);
    return takes_list ? parseAssignment(key + "=" + *text).value : result;
  } catch (const std::invalid_argument&) {
    return result;  // no such key, or not YAML: makeConfig reports it
  }
}

}  // namespace

ParameterValue toParameterValue(XmlRpc::XmlRpcValue& value) {
  switch (value.getType()) {
    case XmlRpc::XmlRpcValue::TypeBoolean:
      return {static_cast<bool>(static_cast<bool&>(value))};
    case XmlRpc::XmlRpcValue::TypeInt:
      return {static_cast<std::int64_t>(static_cast<int&>(value))};
    case XmlRpc::XmlRpcValue::TypeDouble:
      return {static_cast<double>(static_cast<double&>(value))};
    case XmlRpc::XmlRpcValue::TypeString:
      return {static_cast<std::string&>(value)};
    case XmlRpc::XmlRpcValue::TypeArray: {
      ParameterValue::List list;
      // begin() and end() run over the members of a struct.
      for (int k = 0; k < value.size(); ++k) {  // NOLINT(modernize-loop-convert)
        // No deeper: no parameter takes lists of lists.
        const bool is_list = value[k].getType() == XmlRpc::XmlRpcValue::TypeArray;
        list.push_back(is_list ? ParameterValue{ParameterValue::Map{}} : toParameterValue(value[k]));
      }
      return {std::move(list)};
    }
    case XmlRpc::XmlRpcValue::TypeStruct:
      return {ParameterValue::Map{}};  // toParameterEntries reads the section of a radar
    default:
      return {};  // nothing, dates and binary data: refused by whatever key has them
  }
}

XmlRpc::XmlRpcValue toXmlRpc(const ParameterEntries& entries) {
  // Starts from an empty struct: without entries the map would have no type, and no server takes a value
  // without a type.
  int offset = 0;
  XmlRpc::XmlRpcValue map("<value><struct></struct></value>", &offset);
  for (const ParameterEntry& entry : entries) map[entry.key] = std::visit(ToXmlRpc(), entry.value.data);
  return map;
}

ParameterEntries toParameterEntries(XmlRpc::XmlRpcValue& map, const std::string& name_space) {
  ParameterEntries entries;
  if (map.getType() != XmlRpc::XmlRpcValue::TypeStruct) return entries;
  for (auto& [key, value] : map) {
    if (isReserved(key)) continue;
    const std::string path = name_space + "/" + key;
    ParameterValue::Map section;
    if (value.getType() == XmlRpc::XmlRpcValue::TypeStruct) {
      for (auto& [inner, inner_value] : value)
        section.push_back({inner, toValueOf(inner, inner_value), kParameterServer + path + "/" + inner});
    }
    entries.push_back(
        {key, section.empty() ? toValueOf(key, value) : ParameterValue{section}, kParameterServer + path});
  }
  return entries;
}

ConfigError withHintOfServer(const ConfigError& error, const std::string& name_space) {
  std::vector<std::string> faults = error.faults();
  for (std::string& fault : faults)
    if (fault.rfind(kParameterServer + name_space + "/", 0) == 0)
      fault += " (perhaps left by an earlier run: rosparam delete " + name_space + ")";
  return ConfigError(std::move(faults));
}

Config configFromRos(const ros::NodeHandle& private_node) {
  const std::string& name_space = private_node.getNamespace();
  ParameterEntries entries;
  if (private_node.hasParam("config")) {
    std::string file;
    if (!private_node.getParam("config", file) || file.empty()) {
      throw ConfigError(
          {kParameterServer + name_space + "/config: expected the name or the path of a configuration"});
    }
    entries = readParameterFile(findConfigFile(file));
  }
  XmlRpc::XmlRpcValue map;
  if (private_node.getParam(name_space, map)) {
    for (ParameterEntry& entry : toParameterEntries(map, name_space)) entries.push_back(std::move(entry));
  }
  try {
    Config config = makeConfig(entries);
    for (const std::string& warning : mountingWarnings(config))
      ROS_WARN_STREAM(name_space << ": " << warning);
    return config;
  } catch (const ConfigError& error) {
    throw withHintOfServer(error, name_space);
  }
}

void showEffectiveParameters(const ros::NodeHandle& private_node, const Config& config) {
  private_node.deleteParam(kEffective);
  private_node.setParam(kEffective, toXmlRpc(readParameters(toYaml(config), "the effective parameters")));
}

}  // namespace rio_t
