#pragma once

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace rio_t {

namespace fs = std::filesystem;

inline std::string contents(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// The summary without the keys that time the run, which stand at its end.
inline std::string untimed(const std::string& summary) {
  return summary.substr(0, summary.find("estimation_seconds"));
}

}  // namespace rio_t
