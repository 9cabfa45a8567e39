#include <filesystem>
#include <ostream>
#include <stdexcept>

#include "../command_line.h"
#include "rio_t/ros/bag/calibration.h"

namespace rio_t {
namespace {

namespace fs = std::filesystem;

const ProgramText kText = {
    "calibrate", "BAG... --config NAME_OR_PATH --out FILE.yaml [--set key=value]... [--output-dir FOLDER]\n",
    "Finds time offset and mounting of every radar from one or more ROS 1 bags of one rig. It solves each "
    "bag as\n"
    "a batch, combines the bags, prints a table, and writes a configuration to use next time. It needs no "
    "roscore.",
    "rosrun rio_t calibrate walk.bag --config my.yaml --out calibrated.yaml\n"
    "rosrun rio_t calibrate walk.bag turns.bag --config my.yaml --out calibrated.yaml --output-dir runs\n"
    "rosrun rio_t calibrate walk.bag --config my.yaml --out calibrated.yaml --set "
    "estimate_extrinsics=rotation\n",
    "The estimate starts from offset and mounting of the configuration, with the sigmas time_offset_sigma,\n"
    "extrinsics_rotation_sigma and extrinsics_translation_sigma. estimate_extrinsics: rotation leaves a "
    "lever\n"
    "arm that is given as it is; pose and none, which is the default, estimate it, too. mode is always batch "
    "here.\n"
    "A number is observed if its sigma is at most half of the sigma at the start. A number that is not "
    "observed\n"
    "stays as it was, and the table says what to move. A bag that fails does not count; the others do.\n"};

struct Arguments {
  std::vector<std::string> bags;
  std::string config, out, output_folder;
  ParameterEntries set;
};

void addOptions(OptionSet& options, Arguments& a) {
  addBagOptions(options, a.bags, a.config, a.set);
  options.text("out", "FILE.yaml",
               "the configuration goes there: the keys of --config and --set, with what was found", a.out);
  options.text("output-dir", "FOLDER", "gets a folder for each bag with the files that rio_t_bag writes",
               a.output_folder);
}

/// Before the work, so that a wrong path costs no time.
void checkFiles(const Arguments& arguments, const std::string& config_file) {
  for (const std::string& bag : arguments.bags) {
    if (!fs::is_regular_file(bag))
      throw std::runtime_error("--bag " + bag + ": no such file; expected a bag");
  }
  std::vector<std::string> inputs = arguments.bags;
  inputs.push_back(config_file);
  const std::string fault = faultOfOutput(arguments.out, inputs);
  if (!fault.empty()) throw UsageError("--out " + fault);
}

void checkConfig(const Config& config) {
  for (const Config& radar : configsOfRadars(config)) {
    if (radar.extrinsics_source == ExtrinsicsSource::kParameters) continue;
    throw std::runtime_error(
        "extrinsics_source: expected parameters, got tf: the mounting found is written to "
        "extrinsics_translation and extrinsics_rotation_xyzw; set these to what tf says, and --set "
        "extrinsics_source=parameters");
  }
}

int run(const Arguments& arguments, std::ostream& out, std::ostream& err) {
  require({{"BAG", !arguments.bags.empty()},
           {"--config", !arguments.config.empty()},
           {"--out", !arguments.out.empty()}});
  const std::string config_file = findConfigFile(arguments.config);
  checkFiles(arguments, config_file);
  ParameterEntries entries = readParameterFile(config_file);
  entries.insert(entries.end(), arguments.set.begin(), arguments.set.end());
  const Config config = makeConfig(entries);
  checkConfig(config);

  const BagCalibration calibration =
      calibrateFromBags({arguments.bags, arguments.output_folder, config, true});
  for (const CalibrationBag& bag : calibration.bags) {
    for (const std::string& warning : bag.warnings)
      err << "calibrate: warning: bag " << bag.path << ": " << warning << "\n";
    if (!bag.failure.empty())
      err << "calibrate: bag " << bag.path << " does not count: " << bag.failure << "\n";
  }
  if (calibration.radars.empty())
    throw std::runtime_error("no bag is left; " + arguments.out + " is not written");
  out << describeCalibration(calibration);
  const std::string kept =
      writeFile(arguments.out, calibratedYaml(calibration, config, entries, arguments.config));
  out << "written to " << arguments.out << (kept.empty() ? "" : " (the old file is now " + kept + ")")
      << "\n";
  return 0;
}

}  // namespace

int runCalibrationTool(const std::vector<std::string>& words, std::ostream& out, std::ostream& err) {
  Arguments arguments;
  OptionSet options("Options");
  addOptions(options, arguments);
  return runProgram(kText, options, words, out, err, [&] { return run(arguments, out, err); });
}

}  // namespace rio_t
