#include "rio_t/ros/parameters/ros_parameters.h"

#include <set>

namespace rio_t {

ParameterValue toParameterValue(XmlRpc::XmlRpcValue& value) {
  ParameterValue result;
  switch (value.getType()) {
    case XmlRpc::XmlRpcValue::TypeBoolean:
      result.data = static_cast<bool>(static_cast<bool&>(value));
      break;
    case XmlRpc::XmlRpcValue::TypeInt:
      result.data = static_cast<std::int64_t>(static_cast<int&>(value));
      break;
    case XmlRpc::XmlRpcValue::TypeDouble:
      result.data = static_cast<double>(static_cast<double&>(value));
      break;
    case XmlRpc::XmlRpcValue::TypeString:
      result.data = static_cast<std::string&>(value);
      break;
    case XmlRpc::XmlRpcValue::TypeArray: {
      ParameterValue::List list;
      // begin() and end() are those of a struct's members.
      for (int k = 0; k < value.size(); ++k) {  // NOLINT(modernize-loop-convert)
        // No deeper: no parameter takes lists of lists.
        const bool is_list = value[k].getType() == XmlRpc::XmlRpcValue::TypeArray;
        list.push_back(is_list ? ParameterValue{ParameterValue::Map{}} : toParameterValue(value[k]));
      }
      result.data = std::move(list);
      break;
    }
    case XmlRpc::XmlRpcValue::TypeStruct:
      result.data = ParameterValue::Map{};  // toParameterEntries reads the section of a radar
      break;
    default:
      break;  // nothing, dates and binary data: refused by whatever key has them
  }
  return result;
}

ParameterEntries toParameterEntries(XmlRpc::XmlRpcValue& map, const std::string& name_space) {
  static const std::set<std::string> of_others = {"config", "diagnostic_period", "diagnostic_updater"};
  ParameterEntries entries;
  if (map.getType() != XmlRpc::XmlRpcValue::TypeStruct) return entries;
  for (auto& [key, value] : map) {
    if (of_others.count(key) != 0) continue;
    const std::string path = name_space + "/" + key;
    ParameterValue::Map section;
    if (value.getType() == XmlRpc::XmlRpcValue::TypeStruct) {
      for (auto& [inner, inner_value] : value)
        section.push_back({inner, toParameterValue(inner_value), "parameter " + path + "/" + inner});
    }
    entries.push_back(
        {key, section.empty() ? toParameterValue(value) : ParameterValue{section}, "parameter " + path});
  }
  return entries;
}

Config configFromRos(const ros::NodeHandle& private_node) {
  const std::string& name_space = private_node.getNamespace();
  ParameterEntries entries;
  if (private_node.hasParam("config")) {
    std::string file;
    if (!private_node.getParam("config", file) || file.empty()) {
      throw ConfigError(
          {"parameter " + name_space + "/config: expected the name or the path of a configuration"});
    }
    entries = readParameterFile(findConfigFile(file));
  }
  XmlRpc::XmlRpcValue map;
  if (private_node.getParam(name_space, map)) {
    for (ParameterEntry& entry : toParameterEntries(map, name_space)) entries.push_back(std::move(entry));
  }
  return makeConfig(entries);
}

}  // namespace rio_t
