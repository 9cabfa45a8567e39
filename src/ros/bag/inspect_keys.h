#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "rio_t/ros/parameters/parameters.h"

namespace rio_t {

/// A key of a configuration that a program proposes, and why.
struct ProposedKey {
  std::string key;
  ParameterValue value;
  std::string why;
};

/// Keys of one level: each key once, in the order of their first appearance.
class ProposedKeys {
 public:
  /// Replaces an earlier value of the key.
  void set(const std::string& key, ParameterValue value, const std::string& why = "");
  void set(const std::string& key, const std::string& text, const std::string& why = "");
  void add(const ProposedKeys& other);
  void remove(const std::string& key);
  /// Null for a key that is not there; valid until the keys change.
  const ProposedKey* find(const std::string& key) const;
  const std::vector<ProposedKey>& all() const { return keys_; }

 private:
  std::vector<ProposedKey> keys_;
};

/// A configuration: the top level, and the section of each of several radars.
struct ProposedConfig {
  ProposedKeys top_level;
  std::vector<std::pair<std::string, ProposedKeys>> radars;  ///< by name; empty: one radar, at the top level
};

bool isConfigured(const std::string& key, const ParameterEntries& configured);

/// Whether the key belongs to one bag, and so not to a configuration for the next ones.
bool isOfOneBag(const std::string& key);

/// Rounds to a multiple of 1 / `per`; never minus zero.
double rounded(double value, double per);

/// Makes each line of `text` a comment. Replaces control characters: a file name may hold some, and one could
/// end the comment.
std::string commented(const std::string& text, const std::string& indent);

/// One line for each key, with its reason as a comment above.
std::string toYaml(const ProposedKeys& keys, const std::string& indent);

/// The text of a file with the keys that differ from the defaults, each with a comment. `header`: lines for
/// its beginning.
std::string toYaml(const ProposedConfig& proposed, const std::string& header);

/// Reads the text of a file as the programs do. Throws ConfigError.
Config readBack(const std::string& yaml);

}  // namespace rio_t
