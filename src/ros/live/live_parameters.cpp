#include "rio_t/ros/live/live_parameters.h"

#include <algorithm>
#include <boost/algorithm/string/join.hpp>
#include <limits>
#include <stdexcept>
#include <utility>
#include <variant>

#include "rio_t/ros/parameters/ros_parameters.h"

namespace rio_t {
namespace {

const char* const kOrigin = "dynamic_reconfigure";

template <typename Parameter, typename Value>
Parameter parameterOf(const std::string& name, const Value& value) {
  Parameter parameter;
  parameter.name = name;
  parameter.value = value;
  return parameter;
}

/// The parameter message has whole numbers of 32 bits.
std::int32_t clamped(double x) {
  constexpr double kMin = std::numeric_limits<std::int32_t>::min(),
                   kMax = std::numeric_limits<std::int32_t>::max();
  return static_cast<std::int32_t>(std::clamp(x, kMin, kMax));
}

ParameterDescription descriptionOf(const std::string& key) {
  for (ParameterDescription& each : parameterDescriptions())
    if (each.key == key) return each;
  throw std::logic_error("no parameter " + key);
}

/// The name of the kind, as dynamic_reconfigure has it.
std::string typeOf(const ParameterDescription& about) {
  return about.type == "boolean" ? "bool" : about.type == "integer" ? "int" : "double";
}

}  // namespace

LiveParameters::LiveParameters(const Config& config) {
  for (const std::string& key : liveKeys()) values_[key] = parameterValue(config, key);
}

ParameterEntries LiveParameters::changesFrom(const Config& config) const {
  std::vector<std::string> faults;
  for (const std::string& name : unknown_)
    faults.push_back(kOrigin + (": \"" + name + "\" does not change while the node runs; what does: ") +
                     boost::algorithm::join(liveKeys(), ", "));
  if (!faults.empty()) throw ConfigError(std::move(faults));
  const LiveParameters before(config);
  ParameterEntries changes;
  for (const auto& [key, value] : values_)
    if (value.yaml() != before.values_.at(key).yaml()) changes.push_back({key, value, kOrigin});
  return changes;
}

dynamic_reconfigure::ConfigDescription LiveParameters::__getDescriptionMessage__() {
  dynamic_reconfigure::ConfigDescription message;
  dynamic_reconfigure::Group group;
  group.name = "Default";
  const LiveParameters defaults;
  for (const std::string& key : liveKeys()) {
    const ParameterDescription about = descriptionOf(key);
    dynamic_reconfigure::ParamDescription parameter;
    parameter.name = key;
    parameter.type = typeOf(about);
    parameter.description = (about.unit.empty() ? "" : "[" + about.unit + "] ") + about.description;
    group.parameters.push_back(parameter);
  }
  message.groups.push_back(group);
  __getMin__().__toMessage__(message.min);
  __getMax__().__toMessage__(message.max);
  defaults.__toMessage__(message.dflt);
  return message;
}

LiveParameters LiveParameters::endsOfRanges(bool upper) {
  LiveParameters ends;
  for (auto& [key, value] : ends.values_) {
    const ParameterDescription about = descriptionOf(key);
    const double end = upper ? about.max : about.min;
    if (about.type == "boolean") {
      value.data = upper;
    } else if (about.type == "integer") {
      value.data = std::int64_t{clamped(end)};
    } else {
      value.data = end;
    }
  }
  return ends;
}

void LiveParameters::__fromServer__(const ros::NodeHandle& node) {
  XmlRpc::XmlRpcValue read;
  for (auto& [key, value] : values_)
    if (node.getParam("effective/" + key, read)) value = toParameterValue(read);
}

bool LiveParameters::__fromMessage__(dynamic_reconfigure::Config& message) {
  const auto take = [&](const auto& parameters, auto convert) {
    for (const auto& parameter : parameters) {
      const auto found = values_.find(parameter.name);
      if (found == values_.end()) {
        unknown_.push_back(parameter.name);
      } else {
        found->second.data = convert(parameter.value);
      }
    }
  };
  take(message.bools, [](auto value) { return value != 0; });
  take(message.ints, [](auto value) { return std::int64_t{value}; });
  take(message.doubles, [](double value) { return value; });
  take(message.strs, [](const std::string& value) { return value; });
  return true;
}

void LiveParameters::__toMessage__(dynamic_reconfigure::Config& message) const {
  message = {};
  for (const auto& [key, value] : values_) {
    if (const bool* truth = std::get_if<bool>(&value.data)) {
      message.bools.push_back(
          parameterOf<dynamic_reconfigure::BoolParameter>(key, static_cast<std::uint8_t>(*truth)));
    } else if (const auto* whole = std::get_if<std::int64_t>(&value.data)) {
      message.ints.push_back(
          parameterOf<dynamic_reconfigure::IntParameter>(key, clamped(static_cast<double>(*whole))));
    } else {
      message.doubles.push_back(
          parameterOf<dynamic_reconfigure::DoubleParameter>(key, std::get<double>(value.data)));
    }
  }
  dynamic_reconfigure::GroupState group;  // rqt_reconfigure shows a group with its state
  group.name = "Default";
  group.state = 1;
  message.groups.push_back(group);
}

}  // namespace rio_t
