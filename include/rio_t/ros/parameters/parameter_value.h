#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

namespace rio_t {

struct ParameterEntry;

/// The value of a parameter, from a YAML file, the command line or the ROS parameter server.
struct ParameterValue {
  using List = std::vector<ParameterValue>;
  /// Nested keys, which are the section of a radar. An empty map stands for deeper levels and for a list in a
  /// list: no parameter takes these, but messages must be able to name them.
  using Map = std::vector<ParameterEntry>;
  std::variant<std::monostate, bool, std::int64_t, double, std::string, List, Map> data;

  /// For messages: `0.25`, `"text"`, `[1, 2]`, `nothing`.
  std::string describe() const;
  /// As in a parameter file: it reads back as the same value.
  std::string yaml() const;
};

ParameterValue listOf(const Eigen::VectorXd& numbers);

/// What plain (unquoted) YAML text stands for: truth value, integer, number, nothing, else text.
ParameterValue parsePlainScalar(const std::string& text);

/// One key with its value. `origin` says where it was read, for messages: "config/irs.yaml:12", "--set".
struct ParameterEntry {
  std::string key;
  ParameterValue value;
  std::string origin;
};
using ParameterEntries = std::vector<ParameterEntry>;
/// Origin of an entry from parseAssignment.
inline const std::string kCommandLine = "--set";
/// The origin of an entry from the parameter server begins with this.
inline const std::string kParameterServer = "parameter ";
bool isFromServer(const ParameterEntry& entry);

/// Reads a YAML file, which is flat except for the sections of radars. Throws std::runtime_error with one
/// line that names file, line and what was expected.
ParameterEntries readParameterFile(const std::string& path);
/// Reads the text of a file; `name` stands for its path in messages.
ParameterEntries readParameters(const std::string& yaml, const std::string& name);

/// Reads `key=value` with the value as YAML (`--set`); throws std::invalid_argument.
ParameterEntry parseAssignment(const std::string& text);

}  // namespace rio_t
