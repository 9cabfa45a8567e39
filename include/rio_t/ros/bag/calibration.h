#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "rio_t/odometry/calibration.h"
#include "rio_t/ros/bag/run_output.h"
#include "rio_t/ros/parameters/parameters.h"

namespace rio_t {

struct CalibrationRun {
  std::vector<std::string> bags;  ///< paths
  std::string output_folder;      ///< gets a folder with the files of each bag's run; empty: no files
  Config config;
  bool shows_progress = false;  ///< draws a progress bar for each bag
};

struct CalibrationBag {
  std::string path;
  std::string failure;  ///< why it does not count; empty: it counts
  std::vector<std::string> warnings;
};

/// The calibration of one radar from all bags that count.
struct CalibratedRadar {
  std::string name;  ///< empty if there is only one radar
  RadarCalibration calibration;
  std::vector<OffsetEstimate> offsets;  ///< one for each bag that counts
};

struct BagCalibration {
  std::vector<CalibrationBag> bags;
  std::vector<CalibratedRadar> radars;  ///< in the order of the configuration; empty: no bag counts
};

/// Solves each bag as a batch with offset and extrinsics of every radar, and combines the bags. A bag that
/// fails, does not converge or diverged for most of its scans does not count.
BagCalibration calibrateFromBags(const CalibrationRun& run);

/// Returns why a finished run does not count; empty if it counts.
std::string failureOf(const RunSummary& summary);

/// Returns a table with the configured and the found values, sigmas and verdicts. If a value was not
/// observed, it says which motion would show it.
std::string describeCalibration(const BagCalibration& calibration);
std::string describeCalibration(const CalibratedRadar& radar);

/// Returns the configuration to use next time, as YAML: what the user gave, with offset and extrinsics of
/// each radar replaced. `given`: the entries of file and command line that made `config`. `name`: of that
/// file, for a comment.
std::string calibratedYaml(const BagCalibration& calibration, const Config& config,
                           const ParameterEntries& given, const std::string& name);

/// The program calibrate: `words` are its arguments. Returns the exit status; `err` gets what went wrong.
int runCalibrationTool(const std::vector<std::string>& words, std::ostream& out, std::ostream& err);

}  // namespace rio_t
