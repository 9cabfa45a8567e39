#pragma once

#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "rio_t/ros/parameters/config.h"
#include "rio_t/ros/parameters/parameter_value.h"

namespace rio_t {

/// All that is wrong in a configuration at once.
class ConfigError : public std::runtime_error {
 public:
  explicit ConfigError(std::vector<std::string> faults);
  const std::vector<std::string>& faults() const { return faults_; }  ///< one line each

 private:
  std::vector<std::string> faults_;
};

/// Defaults with the entries on top. If a key comes twice, the later holds. If two sources give the mounting,
/// one as a quaternion and one in words, the later source holds, too. A radar of `radars` has what
/// its section (nested keys, or `name/key`) sets, and what the top level sets for the rest. Throws
/// ConfigError naming every unknown key, wrong type, value out of range and contradiction, each with its
/// origin and what was expected.
Config makeConfig(const ParameterEntries& entries);

/// A sentence for each radar whose mounting no source gives: the run starts, but it is probably not meant.
std::vector<std::string> mountingWarnings(const Config& config);

/// `config` with other values for keys that hold for all radars. Throws ConfigError, as makeConfig, and then
/// nothing has changed.
Config withParameters(const Config& config, const ParameterEntries& entries);
/// The value of a key. Throws std::invalid_argument for a key that does not exist.
ParameterValue parameterValue(const Config& config, const std::string& key);

/// The keys that may change while the live node runs: noises, gates and what is published how often. All hold
/// for all radars, and each has one truth value, whole number or number.
const std::vector<std::string>& liveKeys();

/// What is known of a key.
struct ParameterDescription {
  std::string key;
  std::string type;         ///< "number", "integer", "boolean", "choice", "text" or "list"
  std::string unit;         ///< empty: none
  std::string expected;     ///< e.g. "a finite number above 0 and at most 10"
  std::string description;  ///< full sentences: what it is, typical values, when to change it
  double min = -std::numeric_limits<double>::infinity();  ///< of a number, or of each one of a list
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
