#pragma once

#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "rio_t/ros/parameters/config.h"
#include "rio_t/ros/parameters/parameter_value.h"

namespace rio_t {

/// All faults of a configuration at once.
class ConfigError : public std::runtime_error {
 public:
  explicit ConfigError(std::vector<std::string> faults);
  const std::vector<std::string>& faults() const { return faults_; }  ///< one line each

 private:
  std::vector<std::string> faults_;
};

/// Makes a configuration of the defaults and the entries. If a key comes twice, the later entry counts. A
/// mounting in a later source also replaces one in an earlier source if one is a quaternion and the other has
/// angles. A radar takes its values from its section (nested keys, or `name/key`), and all others from the
/// top level. Throws ConfigError that names every unknown key, wrong type, value out of range and
/// contradiction, each with its origin and what was expected.
Config makeConfig(const ParameterEntries& entries);

/// Returns a sentence for each radar whose mounting no source gives: the run starts, but the user has
/// probably forgotten the mounting.
std::vector<std::string> mountingWarnings(const Config& config);

/// Returns `config` with other values for keys that hold for all radars. Throws ConfigError as makeConfig
/// does.
Config withParameters(const Config& config, const ParameterEntries& entries);
/// The value of a key. Throws std::invalid_argument for a key that does not exist.
ParameterValue parameterValue(const Config& config, const std::string& key);

/// The keys that may change while the live node runs: noises, gates and publishing rates. Each holds for all
/// radars and is a truth value, a whole number or a number.
const std::vector<std::string>& liveKeys();

struct ParameterDescription {
  std::string key;
  std::string type;         ///< "number", "integer", "boolean", "choice", "text" or "list"
  std::string unit;         ///< empty: none
  std::string expected;     ///< e.g. "a finite number above 0 and at most 10"
  std::string description;  ///< full sentences: what it is, typical values, when to change it
  double min = -std::numeric_limits<double>::infinity();  ///< of a number, or of each number of a list
  double max = std::numeric_limits<double>::infinity();   ///< likewise
  std::string group = {};                                 ///< title of its section
  bool of_radar = false;  ///< each radar may have its own value, in its section
  bool first = false;     ///< one of the parameters that a new user reads first
};
/// Every key once, section by section.
std::vector<ParameterDescription> parameterDescriptions();

/// The configuration as YAML with the text of each key as a comment: config/estimator.yaml for a
/// default-constructed one. Reading it back gives the same configuration.
std::string toYaml(const Config& config);

/// The page docs/parameters.md.
std::string parametersMarkdown();

/// Path of a configuration: `name_or_path` itself if it is a file, else that name, with or without ".yaml",
/// in the package's config/. Throws std::runtime_error listing the names there are.
std::string findConfigFile(const std::string& name_or_path);

}  // namespace rio_t
