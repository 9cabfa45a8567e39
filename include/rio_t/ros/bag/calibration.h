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
  Config config;                  ///< what is configured
  bool shows_progress = false;    ///< by a bar for each bag
};

/// The outcome of one bag.
struct CalibrationBag {
  std::string path;
  std::string failure;  ///< why it does not count; empty: it counts
  std::vector<std::string> warnings;
};

/// What the bags that count say of one radar.
struct CalibratedRadar {
  std::string name;  ///< empty if there is but one
  RadarCalibration calibration;
  std::vector<OffsetEstimate> offsets;  ///< by bag that counts
};

struct BagCalibration {
  std::vector<CalibrationBag> bags;
  std::vector<CalibratedRadar> radars;  ///< in the order of the configuration; empty: no bag counts
};

/// Solves each bag as a batch with offset and extrinsics of every radar, and combines the bags. A bag that
/// fails, does not converge or diverged for most of its scans does not count.
BagCalibration calibrateFromBags(const CalibrationRun& run);

/// Why a run that ended does not count; empty if it does.
std::string failureOf(const RunSummary& summary);

/// A table for people: what was configured and found, sigmas, verdicts, and what to move for what was not
/// observed.
std::string describeCalibration(const BagCalibration& calibration);
/// The part of one radar.
std::string describeCalibration(const CalibratedRadar& radar);

/// The configuration to use next time, as YAML: what the user gave, with offset and extrinsics of each radar
/// replaced. `given`: the entries of file and command line that made `config`. A comment has the `name`.
std::string calibratedYaml(const BagCalibration& calibration, const Config& config,
                           const ParameterEntries& given, const std::string& name);

/// The program calibrate: `words` are its arguments. Returns the exit status; `err` gets what went wrong.
int runCalibrationTool(const std::vector<std::string>& words, std::ostream& out, std::ostream& err);

}  // namespace rio_t
