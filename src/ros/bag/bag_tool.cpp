#include "rio_t/ros/bag/bag_tool.h"

#include <unistd.h>

#include <cstdio>
#include <exception>
#include <ostream>
#include <stdexcept>

#include "rio_t/ros/bag/bag_runner.h"

namespace rio_t {
namespace {

const char* const kHelp =
    "usage: rio_t_bag --bag BAG --config NAME_OR_PATH --output-dir FOLDER [--set key=value]...\n"
    "       rio_t_bag --print-config [--config NAME_OR_PATH] [--set key=value]...\n"
    "\n"
    "Plays a ROS 1 bag through the radar-inertial odometry as fast as it goes; needs no roscore.\n"
    "  --bag BAG               bag with IMU and radar\n"
    "  --config NAME_OR_PATH   irs, ti_mmwave, ... of the package's config/, or a YAML file\n"
    "  --output-dir FOLDER     gets trajectory.txt, trajectory_optimized.txt (TUM), navigation.csv,\n"
    "                          time_offset.csv, ego_velocity.csv, biases.csv, summary.yaml;\n"
    "                          extrinsics.csv if they are estimated; with several radars one each of\n"
    "                          these and of the tables of time offset and ego-velocity, with their names\n"
    "  --set key=value         sets a parameter on top of the configuration, e.g. --set "
    "stamp_source=arrival\n"
    "                          left/radar_topic=/scan sets it for the radar named left\n"
    "                          mode=batch solves the whole bag at once, mode=refine plays it in passes\n"
    "  --print-config          prints every parameter with unit, range and meaning\n"
    "  --help                  prints this\n";

struct Arguments {
  std::string bag, config, output_folder;
  ParameterEntries set;
  bool print_config = false;
  bool help = false;
};

Arguments parse(const std::vector<std::string>& words) {
  Arguments arguments;
  for (std::size_t i = 0; i < words.size(); ++i) {
    std::string name = words[i];
    if (name.rfind("__", 0) == 0 && name.find(":=") != std::string::npos) continue;  // roslaunch's remappings
    if (name == "--help" || name == "-h") {
      arguments.help = true;
      return arguments;
    }
    if (name == "--print-config") {
      arguments.print_config = true;
      continue;
    }
    std::string value;
    const std::size_t equals = name.find('=');
    const bool joined = name.rfind("--", 0) == 0 && equals != std::string::npos;
    if (joined) {
      value = name.substr(equals + 1);
      name.resize(equals);
    }
    const bool known = name == "--bag" || name == "--config" || name == "--output-dir" || name == "--set";
    if (!known) throw std::invalid_argument("unknown argument " + words[i] + " (see --help)");
    if (!joined) {
      if (i + 1 == words.size())
        throw std::invalid_argument(name + ": expected a value after it (see --help)");
      value = words[++i];
    }
    if (value.empty()) throw std::invalid_argument(name + ": expected a value, got nothing (see --help)");
    if (name == "--bag") arguments.bag = value;
    if (name == "--config") arguments.config = value;
    if (name == "--output-dir") arguments.output_folder = value;
    if (name == "--set") arguments.set.push_back(parseAssignment(value));
  }
  if (arguments.print_config) return arguments;
  std::string missing;
  if (arguments.bag.empty()) missing += " --bag";
  if (arguments.config.empty()) missing += " --config";
  if (arguments.output_folder.empty()) missing += " --output-dir";
  if (!missing.empty()) throw std::invalid_argument("missing argument" + missing + " (see --help)");
  return arguments;
}

void showProgress(double done) {
  const int width = 40;
  const int filled = static_cast<int>(done * width);
  const std::string bar = std::string(static_cast<std::size_t>(filled), '#') +
                          std::string(static_cast<std::size_t>(width - filled), ' ');
  std::fprintf(stderr, "\r[%s] %3d %%", bar.c_str(), static_cast<int>(100.0 * done));
  if (done >= 1.0) std::fprintf(stderr, "\n");
}

int run(const Arguments& arguments, std::ostream& out, std::ostream& err) {
  if (arguments.help) {
    out << kHelp;
    return 0;
  }
  ParameterEntries entries;
  if (!arguments.config.empty()) entries = readParameterFile(findConfigFile(arguments.config));
  entries.insert(entries.end(), arguments.set.begin(), arguments.set.end());
  const Config config = makeConfig(entries);
  if (arguments.print_config) {
    out << toYaml(config);
    return 0;
  }
  BagRun bag_run{arguments.bag, arguments.output_folder, config, nullptr};
  if (isatty(STDERR_FILENO) != 0) bag_run.progress = showProgress;
  const RunSummary summary = runBag(bag_run);
  for (const std::string& warning : summary.warnings) err << "rio_t_bag: warning: " << warning << "\n";
  out << arguments.bag << "\n" << describeRun(summary, arguments.output_folder);
  return 0;
}

}  // namespace

int runBagTool(const std::vector<std::string>& words, std::ostream& out, std::ostream& err) {
  try {
    return run(parse(words), out, err);
  } catch (const std::exception& error) {
    err << "rio_t_bag: " << error.what() << "\n";
    return 1;
  }
}

}  // namespace rio_t
