#pragma once

#include <XmlRpcValue.h>
#include <ros/node_handle.h>

#include <string>

#include "rio_t/ros/parameters/parameters.h"

namespace rio_t {

/// A value of the ROS parameter server. `value` is not const because XmlRpc gives no const access.
ParameterValue toParameterValue(XmlRpc::XmlRpcValue& value);

/// The entries of a map of the parameter server, `name_space` being where it was found. Keys that other
/// libraries read from a node's private parameters (diagnostic_updater) are left out.
ParameterEntries toParameterEntries(XmlRpc::XmlRpcValue& map, const std::string& name_space);

/// Configuration of a node: the file that its private parameter `config` names (a name of the package's
/// config/, or a path), if any, with the other private parameters on top. Throws ConfigError, or
/// std::runtime_error.
Config configFromRos(const ros::NodeHandle& private_node);

}  // namespace rio_t
