#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "rio_t/ros/parameters/parameter_value.h"

namespace rio_t {

/// The input of check_bag, and the files that it writes.
struct CheckRequest {
  std::vector<std::string> bags;          ///< paths
  std::string out;                        ///< gets the configuration; empty: none
  std::string rig;                        ///< PNG with the rig drawn; empty: none
  std::string imu_topic;                  ///< empty: the best one
  std::vector<std::string> radar_topics;  ///< empty: all that fit
  ParameterEntries set;                   ///< parameters that the user gives; the clouds are read with them
  double duration = 120.0;                ///< [s] to read of each recording; 0: all of it
  bool bags_go_away = false;              ///< the bags are temporary: they are gone when the program ends
  bool try_out = true;  ///< whether to run the odometry on the bag with the proposed configuration
};

enum class FindingLevel {
  kOk,       ///< "OK"
  kOdd,      ///< "odd": the configuration deals with it, or it is worth knowing
  kMissing,  ///< "missing": the odometry cannot run
};

struct Finding {
  FindingLevel level = FindingLevel::kOk;
  std::string subject;  ///< "IMU", "radar /scan", ...
  std::string text;     ///< one sentence, or phrases
};

/// A finding of check_bag about a bag, an IMU or a radar.
struct Findings {
  std::vector<Finding> findings;
  std::string to_do;  ///< one sentence if something is missing

  void tell(FindingLevel level, const std::string& subject, const std::string& text) {
    findings.push_back({level, subject, text});
  }
  void ok(const std::string& subject, const std::string& text) { tell(FindingLevel::kOk, subject, text); }
  void odd(const std::string& subject, const std::string& text) { tell(FindingLevel::kOdd, subject, text); }
  void missing(const std::string& subject, const std::string& what, const std::string& what_to_do) {
    tell(FindingLevel::kMissing, subject, what);
    to_do = what_to_do;
  }
};

/// The findings about one recording, and the configuration for it.
struct BagCheck : Findings {
  std::vector<std::string> bags;  ///< its parts
  std::string yaml;               ///< the configuration; empty if the odometry cannot run
  double quality = 0.0;           ///< larger: the bag shows more of the mounting

  bool ready() const { return !yaml.empty(); }
};

/// Bags that follow one another, as `rosbag record --split` makes them, are the parts of one recording, in
/// the order of time. Throws std::runtime_error for a bag that cannot be read.
std::vector<std::vector<std::string>> recordingsOf(std::vector<std::string> paths);

/// Looks at one recording as `request` says. Throws std::runtime_error for a bag that cannot be read.
BagCheck checkBag(const std::vector<std::string>& bags, const CheckRequest& request);

std::string describeCheck(const BagCheck& check);

/// Throws std::invalid_argument if the request cannot be met, and ConfigError for parameters that are wrong.
void validate(const CheckRequest& request);

/// Checks all bags, prints the reports and writes the files. Returns the exit status: 0 ready, 1 something is
/// missing. Throws as validate(), and std::runtime_error for files that cannot be read or written.
int runCheck(const CheckRequest& request, std::ostream& out);

}  // namespace rio_t
