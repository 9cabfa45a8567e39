#include "command_line.h"

#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <stdexcept>

namespace rio_t {
namespace {

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

void showProgress(double done) {
  const int width = 40;
  const int filled = static_cast<int>(done * width);
  const std::string bar = std::string(static_cast<std::size_t>(filled), '#') +
                          std::string(static_cast<std::size_t>(width - filled), ' ');
  std::fprintf(stderr, "\r[%s] %3d %%", bar.c_str(), static_cast<int>(100.0 * done));
  if (done >= 1.0) std::fprintf(stderr, "\n");
}

}  // namespace

std::vector<GivenOption> readOptions(const std::vector<std::string>& words,
                                     const std::vector<std::string>& with_value,
                                     const std::vector<std::string>& flags) {
  std::vector<GivenOption> given;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (word.rfind("__", 0) == 0 && word.find(":=") != std::string::npos) continue;  // roslaunch's remappings
    if (word == "--help" || word == "-h") {
      given.push_back({"help", ""});
      return given;
    }
    const bool dashed = word.rfind("--", 0) == 0;
    if (dashed && contains(flags, word.substr(2))) {
      given.push_back({word.substr(2), ""});
      continue;
    }
    const std::size_t equals = dashed ? word.find('=') : std::string::npos;
    const std::string name = word.substr(0, equals);
    if (!dashed || !contains(with_value, name.substr(2)))
      throw std::invalid_argument("unknown argument " + word + " (see --help)");
    if (equals == std::string::npos && i + 1 == words.size())
      throw std::invalid_argument(name + ": expected a value after it (see --help)");
    const std::string value = equals == std::string::npos ? words[++i] : word.substr(equals + 1);
    if (value.empty()) throw std::invalid_argument(name + ": expected a value, got nothing (see --help)");
    given.push_back({name.substr(2), value});
  }
  return given;
}

std::function<void(double)> progressBar() {
  if (isatty(STDERR_FILENO) == 0) return nullptr;
  return showProgress;
}

}  // namespace rio_t
