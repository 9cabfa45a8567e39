#include "rio_t/ros/bag/bag_tool.h"

#include <exception>
#include <ostream>
#include <stdexcept>

#include "command_line.h"
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
  for (const GivenOption& option :
       readOptions(words, {"bag", "config", "output-dir", "set"}, {"print-config"})) {
    if (option.name == "help") arguments.help = true;
    if (option.name == "print-config") arguments.print_config = true;
    if (option.name == "bag") arguments.bag = option.value;
    if (option.name == "config") arguments.config = option.value;
    if (option.name == "output-dir") arguments.output_folder = option.value;
    if (option.name == "set") arguments.set.push_back(parseAssignment(option.value));
  }
  if (arguments.help) return arguments;
  if (arguments.print_config) return arguments;
  std::string missing;
  if (arguments.bag.empty()) missing += " --bag";
  if (arguments.config.empty()) missing += " --config";
  if (arguments.output_folder.empty()) missing += " --output-dir";
  if (!missing.empty()) throw std::invalid_argument("missing argument" + missing + " (see --help)");
  return arguments;
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
  bag_run.progress = progressBar();
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
