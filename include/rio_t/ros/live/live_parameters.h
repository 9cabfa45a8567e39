#pragma once

#include <dynamic_reconfigure/Config.h>
#include <dynamic_reconfigure/ConfigDescription.h>
#include <ros/node_handle.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "rio_t/ros/parameters/parameters.h"

namespace rio_t {

/// The parameters that may change while the live node runs (liveKeys()), as dynamic_reconfigure::Server wants
/// its ConfigType. Its generated headers have the same members with the same names; here texts, units and
/// ranges come from the registry of the parameters, so that they stand in one place.
class LiveParameters {
 public:
  /// The defaults.
  LiveParameters() : LiveParameters(Config()) {}
  explicit LiveParameters(const Config& config);

  /// The values that differ from those of `config`, as entries with the origin "dynamic_reconfigure". Throws
  /// ConfigError if a message had other keys.
  ParameterEntries changesFrom(const Config& config) const;

  // The server calls these and prescribes their names.
  static dynamic_reconfigure::ConfigDescription __getDescriptionMessage__();
  static LiveParameters __getDefault__() { return {}; }
  static LiveParameters __getMin__() { return endsOfRanges(false); }
  static LiveParameters __getMax__() { return endsOfRanges(true); }
  static int __getParamDescriptions__() { return 0; }  ///< not needed: each value knows its kind
  static int __getGroupDescriptions__() { return 0; }
  void __clamp__() {}  ///< a value out of range is refused, with a message, and not bent
  std::uint32_t __level__(const LiveParameters&) const { return 0; }
  /// Reads the values that hold from `~effective`, so that the server never shows others.
  void __fromServer__(const ros::NodeHandle& node);
  /// Writes none: the next start would take them for parameters of the user.
  void __toServer__(const ros::NodeHandle&) const {}
  /// The kinds of the message decide.
  bool __fromMessage__(dynamic_reconfigure::Config& message);
  void __toMessage__(dynamic_reconfigure::Config& message) const;
  void __toMessage__(dynamic_reconfigure::Config& message, int /*parameters*/, int /*groups*/) const {
    __toMessage__(message);
  }
  // NOLINTEND(bugprone-reserved-identifier)

 private:
  static LiveParameters endsOfRanges(bool upper);

  std::map<std::string, ParameterValue> values_;  // by key
  std::vector<std::string> unknown_;              // keys of a message that are none of these
};

}  // namespace rio_t
