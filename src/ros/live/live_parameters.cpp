#include "rio_t/ros/live/live_parameters.h"

#include <algorithm>
#include <limits>
#include <type_traits>
#include <variant>

namespace rio_t {
namespace {

template <typename Parameter, typename Value>
Parameter parameterOf(const std::string& name, const Value& value) {
  Parameter parameter;
  parameter.name = name;
  parameter.value = value;
  return parameter;
}

LiveValue plain(const ParameterValue& value) {
  if (const bool* truth = std::get_if<bool>(&value.data)) return *truth;
  if (const std::int64_t* whole = std::get_if<std::int64_t>(&value.data)) return *whole;
  return std::get<double>(value.data);
}

/// The name of the kind, as dynamic_reconfigure has it.
std::string typeOf(const LiveValue& value) {
  if (std::holds_alternative<bool>(value)) return "bool";
  return std::holds_alternative<std::int64_t>(value) ? "int" : "double";
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

/// Each value replaced by one end of its range.
template <typename End>
std::map<std::string, LiveValue> endsOf(std::map<std::string, LiveValue> values, bool upper, const End& end) {
  for (auto& [key, value] : values) {
    if (bool* truth = std::get_if<bool>(&value)) {
      *truth = upper;
    } else if (std::int64_t* whole = std::get_if<std::int64_t>(&value)) {
      *whole = clamped(end(descriptionOf(key)));
    } else {
      value = end(descriptionOf(key));
    }
  }
  return values;
}

}  // namespace

LiveParameters::LiveParameters(const Config& config) {
  for (const std::string& key : liveKeys()) values_[key] = plain(parameterValue(config, key));
}

ParameterEntries LiveParameters::changesFrom(const Config& config) const {
  const LiveParameters before(config);
  ParameterEntries changes;
  for (const auto& [key, value] : values_)
    if (value != before.values_.at(key))
      std::visit([&](auto each) { changes.push_back({key, {each}, "dynamic_reconfigure"}); }, value);
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
    parameter.type = typeOf(defaults.values_.at(key));
    parameter.description = (about.unit.empty() ? "" : "[" + about.unit + "] ") + about.description;
    group.parameters.push_back(parameter);
  }
  message.groups.push_back(group);
  __getMin__().__toMessage__(message.min);
  __getMax__().__toMessage__(message.max);
  defaults.__toMessage__(message.dflt);
  return message;
}

LiveParameters LiveParameters::__getMin__() {
  LiveParameters ends;
  ends.values_ = endsOf(ends.values_, false, [](const ParameterDescription& about) { return about.min; });
  return ends;
}

LiveParameters LiveParameters::__getMax__() {
  LiveParameters ends;
  ends.values_ = endsOf(ends.values_, true, [](const ParameterDescription& about) { return about.max; });
  return ends;
}

void LiveParameters::__fromServer__(const ros::NodeHandle& node) {
  for (auto& [key, value] : values_) {
    const std::string effective = "effective/" + key;
    std::visit(
        [&](auto& data) {
          using Data = std::decay_t<decltype(data)>;
          if constexpr (std::is_same_v<Data, std::int64_t>) {
            int whole = 0;
            if (node.getParam(effective, whole)) data = whole;
          } else if constexpr (std::is_same_v<Data, double> || std::is_same_v<Data, bool>) {
            Data read = data;
            if (node.getParam(effective, read)) data = read;
          }
        },
        value);
  }
}

bool LiveParameters::__fromMessage__(dynamic_reconfigure::Config& message) {
  const auto take = [&](const auto& parameters, auto convert) {
    for (const auto& parameter : parameters) {
      const auto found = values_.find(parameter.name);
      if (found != values_.end()) found->second = convert(parameter.value);
    }
  };
  take(message.bools, [](auto value) { return value != 0; });
  take(message.ints, [](auto value) { return std::int64_t{value}; });
  take(message.doubles, [](double value) { return value; });
  return true;
}

void LiveParameters::__toMessage__(dynamic_reconfigure::Config& message) const {
  message = {};
  for (const auto& [key, value] : values_) {
    if (const bool* truth = std::get_if<bool>(&value))
      message.bools.push_back(
          parameterOf<dynamic_reconfigure::BoolParameter>(key, static_cast<std::uint8_t>(*truth)));
    if (const auto* whole = std::get_if<std::int64_t>(&value))
      message.ints.push_back(
          parameterOf<dynamic_reconfigure::IntParameter>(key, clamped(static_cast<double>(*whole))));
    if (const double* number = std::get_if<double>(&value))
      message.doubles.push_back(parameterOf<dynamic_reconfigure::DoubleParameter>(key, *number));
  }
  dynamic_reconfigure::GroupState group;  // rqt_reconfigure shows a group with its state
  group.name = "Default";
  group.state = 1;
  message.groups.push_back(group);
}

}  // namespace rio_t
