#pragma once

#include <fstream>
#include <string>
#include <vector>

#include "../src/ros/temporary_folder.h"
#include "rio_t/ros/parameters/parameters.h"

/// Parameters from texts, and what is wrong with them.
namespace rio_t {

class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& text) : path_(folder_.path() + "/parameters.yaml") {
    std::ofstream(path_) << text;
  }
  const std::string& path() const { return path_; }

 private:
  TemporaryFolder folder_;
  std::string path_;
};

inline Config fromAssignments(const std::vector<std::string>& assignments) {
  ParameterEntries entries;
  for (const std::string& each : assignments) entries.push_back(parseAssignment(each));
  return makeConfig(entries);
}

inline std::vector<std::string> faultsOf(const std::vector<std::string>& assignments) {
  try {
    fromAssignments(assignments);
  } catch (const ConfigError& error) {
    return error.faults();
  }
  return {};
}

/// The one fault of one wrong value.
inline std::string faultOf(const std::string& assignment) {
  const std::vector<std::string> faults = faultsOf({assignment});
  return faults.size() == 1 ? faults.front() : "not one fault but " + std::to_string(faults.size());
}

inline std::string messageOfFile(const std::string& text) {
  const TemporaryFile file(text);
  try {
    makeConfig(readParameterFile(file.path()));
  } catch (const std::runtime_error& error) {
    std::string message = error.what();
    const std::size_t at = message.find(file.path());
    return at == std::string::npos ? message : message.replace(at, file.path().size(), "FILE");
  }
  return "nothing wrong";
}

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace rio_t
