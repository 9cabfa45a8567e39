#include <unistd.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <ostream>
#include <stdexcept>
#include <system_error>

#include "command_line.h"
#include "rio_t/ros/bag/calibration.h"

namespace rio_t {
namespace {

namespace fs = std::filesystem;

const char* const kHelp =
    "usage: calibrate --bag BAG [--bag BAG]... --config NAME_OR_PATH --out FILE.yaml\n"
    "                 [--set key=value]... [--output-dir FOLDER]\n"
    "\n"
    "Finds time offset and mounting of every radar from one or more ROS 1 bags; needs no roscore. It solves "
    "each\n"
    "bag as a batch, combines the bags, prints a table, and writes a configuration to use next time.\n"
    "  --bag BAG               bag with IMU and radar; several bags of one rig count together\n"
    "  --config NAME_OR_PATH   irs, ti_mmwave, ... of the package's config/, or a YAML file. Its offset and\n"
    "                          mounting are what is told: where the estimate starts, with the sigmas\n"
    "                          time_offset_sigma, extrinsics_rotation_sigma and "
    "extrinsics_translation_sigma\n"
    "  --set key=value         sets a parameter on top of the configuration, e.g. --set "
    "stamp_source=arrival\n"
    "                          left/radar_topic=/scan sets it for the radar named left\n"
    "                          estimate_extrinsics=rotation leaves the lever arm as told; pose, and none, "
    "which is\n"
    "                          the default, estimate it, too\n"
    "                          mode is always batch here\n"
    "  --out FILE.yaml         gets the configuration: the keys of --config and --set, with what was found\n"
    "  --output-dir FOLDER     gets a folder for each bag with the files that rio_t_bag writes\n"
    "  --help                  prints this\n"
    "\n"
    "A number is observed if its sigma is at most half of the sigma of what was told. What is not observed "
    "stays as\n"
    "told, and the table says what to move. A bag that fails does not count; the others do.\n"
    "Exit status: 0; 1 if no bag is left or something given is wrong.\n";

struct Arguments {
  std::vector<std::string> bags;
  std::string config, out, output_folder;
  ParameterEntries set;
  bool help = false;
};

Arguments parse(const std::vector<std::string>& words) {
  Arguments arguments;
  for (const GivenOption& option : readOptions(words, {"bag", "config", "out", "output-dir", "set"}, {})) {
    if (option.name == "help") arguments.help = true;
    if (option.name == "bag") arguments.bags.push_back(option.value);
    if (option.name == "config") arguments.config = option.value;
    if (option.name == "out") arguments.out = option.value;
    if (option.name == "output-dir") arguments.output_folder = option.value;
    if (option.name == "set") arguments.set.push_back(parseAssignment(option.value));
  }
  if (arguments.help) return arguments;
  std::string missing;
  if (arguments.bags.empty()) missing += " --bag";
  if (arguments.config.empty()) missing += " --config";
  if (arguments.out.empty()) missing += " --out";
  if (!missing.empty()) throw std::invalid_argument("missing argument" + missing + " (see --help)");
  return arguments;
}

bool isSameFile(const std::string& a, const std::string& b) {
  std::error_code error;
  return fs::equivalent(a, b, error);
}

/// Before the work, so that a wrong path costs no time.
void checkFiles(const Arguments& arguments, const std::string& config_file) {
  for (std::size_t i = 0; i < arguments.bags.size(); ++i) {
    const std::string& bag = arguments.bags[i];
    if (!fs::is_regular_file(bag))
      throw std::runtime_error("--bag " + bag + ": no such file; expected a bag");
    for (std::size_t k = 0; k < i; ++k) {
      if (isSameFile(bag, arguments.bags[k]))
        throw std::runtime_error("--bag " + bag + ": expected each bag once, since it would count twice");
    }
    if (isSameFile(arguments.out, bag))
      throw std::runtime_error("--out " + arguments.out + ": expected another file than that of --bag");
  }
  if (isSameFile(arguments.out, config_file)) {
    throw std::runtime_error("--out " + arguments.out +
                             ": expected another file than that of --config, which is never overwritten");
  }
  const fs::path out(arguments.out);
  const fs::path folder = out.has_parent_path() ? out.parent_path() : fs::path(".");
  if (fs::is_directory(out))
    throw std::runtime_error("--out " + arguments.out + ": expected a file, this is a folder");
  if (!fs::is_directory(folder))
    throw std::runtime_error("--out " + arguments.out + ": there is no folder " + folder.string());
  if (access(folder.c_str(), W_OK) != 0)
    throw std::runtime_error("--out " + arguments.out + ": folder " + folder.string() + " cannot be written");
}

void checkConfig(const Config& config) {
  for (const Config& radar : configsOfRadars(config)) {
    if (radar.extrinsics_source == ExtrinsicsSource::kParameters) continue;
    throw std::runtime_error(
        "extrinsics_source: expected parameters, got tf: the mounting found is written to "
        "extrinsics_translation "
        "and extrinsics_rotation_xyzw; set these to what tf says, and --set extrinsics_source=parameters");
  }
}

/// Beside it first, so that a run that fails leaves no half file.
void writeFile(const std::string& path, const std::string& text) {
  const std::string beside = path + ".part";
  {
    std::ofstream file(beside, std::ios::binary | std::ios::trunc);
    file << text;
    file.flush();
    if (file) {
      file.close();
      std::error_code error;
      fs::rename(beside, path, error);
      if (!error) return;
    }
  }
  std::error_code ignored;
  fs::remove(beside, ignored);
  throw std::runtime_error("--out " + path + ": writing failed");
}

int run(const Arguments& arguments, std::ostream& out, std::ostream& err) {
  if (arguments.help) {
    out << kHelp;
    return 0;
  }
  const std::string config_file = findConfigFile(arguments.config);
  checkFiles(arguments, config_file);
  ParameterEntries entries = readParameterFile(config_file);
  entries.insert(entries.end(), arguments.set.begin(), arguments.set.end());
  const Config config = makeConfig(entries);
  checkConfig(config);

  const BagCalibration calibration =
      calibrateFromBags({arguments.bags, arguments.output_folder, config, progressBar()});
  for (const CalibrationBag& bag : calibration.bags) {
    for (const std::string& warning : bag.warnings)
      err << "calibrate: warning: bag " << bag.path << ": " << warning << "\n";
    if (!bag.failure.empty())
      err << "calibrate: bag " << bag.path << " does not count: " << bag.failure << "\n";
  }
  if (calibration.radars.empty())
    throw std::runtime_error("no bag is left; " + arguments.out + " is not written");
  out << describeCalibration(calibration);
  writeFile(arguments.out, calibratedYaml(calibration, config, entries, arguments.config));
  out << "written to " << arguments.out << "\n";
  return 0;
}

}  // namespace

int runCalibrationTool(const std::vector<std::string>& words, std::ostream& out, std::ostream& err) {
  try {
    return run(parse(words), out, err);
  } catch (const std::exception& error) {
    err << "calibrate: " << error.what() << "\n";
    return 1;
  }
}

}  // namespace rio_t
