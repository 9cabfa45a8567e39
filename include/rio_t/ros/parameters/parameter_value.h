#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

namespace rio_t {

struct ParameterEntry;

/// The value of a parameter wherever it came from: a YAML file, the command line, the ROS parameter server.
struct ParameterValue {
  using List = std::vector<ParameterValue>;
  /// Nested keys: the section of a radar. It stands, empty, for what lies deeper and for a list in a list:
  /// no parameter takes any, but the fault must be nameable.
  using Map = std::vector<ParameterEntry>;
  std::variant<std::monostate, bool, std::int64_t, double, std::string, List, Map> data;

  /// For messages: `0.25`, `"text"`, `[1, 2]`, `nothing`.
  std::string describe() const;
  /// As it stands in a parameter file: it reads back as the same value.
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
/// With these words begins the origin of one from the parameter server.
inline const std::string kParameterServer = "parameter ";
bool isOfServer(const ParameterEntry& entry);

/// Reads a YAML file, flat but for the sections of radars; throws std::runtime_error with one line naming
/// file, line and what was expected.
ParameterEntries readParameterFile(const std::string& path);
/// The same of a text; `name` stands for the file in messages.
ParameterEntries readParameters(const std::string& yaml, const std::string& name);

/// Reads `key=value` with the value as YAML (`--set`); throws std::invalid_argument.
ParameterEntry parseAssignment(const std::string& text);

}  // namespace rio_t
