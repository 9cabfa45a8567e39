#pragma once

#include <XmlRpcValue.h>
#include <ros/node_handle.h>

#include <string>

#include "rio_t/ros/parameters/parameters.h"

namespace rio_t {

/// A value of the ROS parameter server. `value` is not const because XmlRpc gives no const access.
ParameterValue toParameterValue(XmlRpc::XmlRpcValue& value);

/// Entries as a map of the parameter server; nested keys become nested maps. Whole numbers beyond 32 bits
/// become floating-point numbers, since the server has no longer ones.
XmlRpc::XmlRpcValue toXmlRpc(const ParameterEntries& entries);

/// The entries of a map of the parameter server, `name_space` being where it was found. Keys that other
/// libraries read from a node's private parameters (diagnostic_updater) are left out, and what
/// showEffectiveParameters wrote. A text such as "[0,0,180]" becomes a list if the key has one: `rosrun`
/// passes lists as texts.
ParameterEntries toParameterEntries(XmlRpc::XmlRpcValue& map, const std::string& name_space);

/// The same faults. Those of parameters of the server say how to remove what an earlier run left there, since
/// the server keeps a misspelt one after the command was corrected.
ConfigError withHintOfServer(const ConfigError& error, const std::string& name_space);

/// Configuration of a node: the file that its private parameter `config` names (of the package's config/, or
/// a path), if any, with the other private parameters on top. Throws ConfigError or std::runtime_error.
Config configFromRos(const ros::NodeHandle& private_node);

/// Writes every parameter of the run to the parameter server, as `~effective`, and removes that of an earlier
/// run: `rosparam get /rio_t/effective` shows it, `rosparam dump run.yaml /rio_t/effective` makes a
/// configuration of it. Call it again if a parameter changes. The user's own parameters stay as they are, so
/// that the next start reads them and not these.
void showEffectiveParameters(const ros::NodeHandle& private_node, const Config& config);

}  // namespace rio_t
