#include <ostream>

#include "../command_line.h"
#include "rio_t/ros/bag/bag_runner.h"
#include "rio_t/ros/parameters/parameters.h"

namespace rio_t {
namespace {

const ProgramText kText = {
    "rio_t_bag",
    "BAG... --config NAME_OR_PATH [--output-dir FOLDER] [--set key=value]...\n"
    "--print-config [--config NAME_OR_PATH] [--set key=value]...\n"
    "--print-parameters\n",
    "Plays ROS 1 bags through the radar-inertial odometry, as fast as the computer can. It needs no roscore.",
    "rosrun rio_t rio_t_bag walk.bag --config irs --output-dir out\n"
    "rosrun rio_t rio_t_bag part_0.bag part_1.bag --config my.yaml --output-dir out\n"
    "rosrun rio_t rio_t_bag walk.bag --config irs --output-dir out --set mode=batch --set "
    "stamp_source=arrival\n"
    "rosrun rio_t rio_t_bag --print-config > all_parameters.yaml\n",
    "The folder gets trajectory.txt, trajectory_optimized.txt (TUM: stamp x y z qx qy qz qw), "
    "navigation.csv,\n"
    "time_offset.csv, ego_velocity.csv, biases.csv and summary.yaml; extrinsics.csv if mounting or lever arm "
    "are estimated;\n"
    "and barometer.csv, ground_vehicle.csv and map.csv if these aids are on.\n"
    "With several radars the tables of a radar carry its name. docs/parameters.md describes every key.\n"};

struct Arguments {
  std::vector<std::string> bags;
  std::string config, output_folder, ground_truth;
  ParameterEntries set;
  bool print_config = false;
  bool print_parameters = false;
};

void addOptions(OptionSet& options, Arguments& a) {
  addBagOptions(options, a.bags, a.config, a.set);
  options.text("output-dir", "FOLDER", "the files go there; without it, only the summary is printed",
               a.output_folder);
  options.text("ground-truth", "FILE",
               "compares with these true poses (TUM); the same as --set ground_truth=FILE", a.ground_truth);
  options.section("Instead of playing");
  options.flag("print-config", "prints the configuration with every parameter", a.print_config);
  options.flag("print-parameters", "prints the page docs/parameters.md", a.print_parameters);
}

int play(const Arguments& arguments, const Config& config, std::ostream& out, std::ostream& err) {
  for (const std::string& warning : mountingWarnings(config))
    err << "rio_t_bag: warning: " << warning << "\n";
  try {
    const RunSummary summary = runBag({arguments.bags, arguments.output_folder, config, progressBar()});
    for (const std::string& warning : summary.warnings) err << "rio_t_bag: warning: " << warning << "\n";
    for (const std::string& bag : arguments.bags) out << bag << "\n";
    out << describeRun(summary, arguments.output_folder);
    return summary.diagnosis.verdict == RunVerdict::kBad ? kExitNotTrusted : kExitOk;
  } catch (const RunFailed& error) {
    err << "rio_t_bag: " << error.what() << "\n";
    if (!error.diagnosis().causes.empty())
      err << "The most likely causes:\n" << describeCauses(error.diagnosis());
    return kExitFailed;
  }
}

int run(const Arguments& arguments, std::ostream& out, std::ostream& err) {
  if (arguments.print_parameters) {
    out << parametersMarkdown();
    return kExitOk;
  }
  if (!arguments.print_config) {
    require({{"BAG", !arguments.bags.empty()}, {"--config", !arguments.config.empty()}});
  }
  ParameterEntries entries;
  if (!arguments.config.empty()) entries = readParameterFile(findConfigFile(arguments.config));
  entries.insert(entries.end(), arguments.set.begin(), arguments.set.end());
  if (!arguments.ground_truth.empty())
    entries.push_back({"ground_truth", {arguments.ground_truth}, "--ground-truth"});
  const Config config = makeConfig(entries);
  if (!arguments.print_config) return play(arguments, config, out, err);
  out << toYaml(config);
  return kExitOk;
}

}  // namespace

int runBagTool(const std::vector<std::string>& words, std::ostream& out, std::ostream& err) {
  Arguments arguments;
  OptionSet options("Options");
  addOptions(options, arguments);
  return runProgram(kText, options, words, out, err, [&] { return run(arguments, out, err); });
}

}  // namespace rio_t
