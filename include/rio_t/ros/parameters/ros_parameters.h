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

/// Returns the entries of a map that was found at `name_space` on the parameter server. Leaves out keys that
/// other libraries (diagnostic_updater) read from a node's private parameters, and what
/// showEffectiveParameters wrote. A text such as "[0,0,180]" becomes a list if the key takes one, since
/// `rosrun` passes lists as texts.
ParameterEntries toParameterEntries(XmlRpc::XmlRpcValue& map, const std::string& name_space);

/// Returns the same faults. Those of the server's parameters also say how to remove what an earlier run left
/// there: the server keeps a misspelt parameter even after the user has corrected the command.
ConfigError withHintOfServer(const ConfigError& error, const std::string& name_space);

/// Returns the configuration of a node: the file that its private parameter `config` names (of the package's
/// config/, or a path), if any, and the other private parameters on top. Throws ConfigError or
/// std::runtime_error.
Config configFromRos(const ros::NodeHandle& private_node);

/// Writes every parameter of the run to the parameter server as `~effective`, in place of those of an earlier
/// run. `rosparam get /rio_t/effective` shows them, `rosparam dump run.yaml /rio_t/effective` makes a
/// configuration of them. Call it again if a parameter changes. The user's own parameters stay as they are,
/// so that the next start reads these.
void showEffectiveParameters(const ros::NodeHandle& private_node, const Config& config);

}  // namespace rio_t
