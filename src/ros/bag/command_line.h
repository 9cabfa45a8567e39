#pragma once

#include <functional>
#include <string>
#include <vector>

/// What the command lines of the bag programs share.
namespace rio_t {

struct GivenOption {
  std::string name;   ///< without dashes
  std::string value;  ///< empty for a flag
};

/// Reads `--name value`, `--name=value` and `--flag`, and skips what roslaunch adds. `--help` (`-h`) is a flag of
/// every program; nothing is read behind it. Throws std::invalid_argument that names the word.
std::vector<GivenOption> readOptions(const std::vector<std::string>& words,
                                     const std::vector<std::string>& with_value,
                                     const std::vector<std::string>& flags);

/// For BagRun::progress: a bar on stderr; empty if stderr is no terminal.
std::function<void(double)> progressBar();

}  // namespace rio_t
