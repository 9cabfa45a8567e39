// Looks at a bag, or at running topics, and proposes a configuration. See `check_bag --help`.
#include <ros/ros.h>
#include <stdlib.h>

#include <boost/program_options.hpp>
#include <exception>
#include <filesystem>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "rio_t/ros/bag/check_bag.h"
#include "ros/live/record_topics.h"

namespace {

namespace options = boost::program_options;
namespace fs = std::filesystem;

constexpr int kUsage = 2;

const char* const kHelp =
    "usage: check_bag BAG... [--out my.yaml] [--rig rig.png]\n"
    "       check_bag --live [--duration 30] [--out my.yaml]\n"
    "\n"
    "Looks at the IMU and the radars of a bag: topics, rates, stamps, units, axes, sign of the Doppler. Finds the\n"
    "mounting of each radar and its time offset roughly, writes a configuration, and runs the odometry with it.\n"
    "Record 3 s at rest, then a minute of motion with turns about all axes.\n\n";

const char* const kExamples =
    "\n"
    "Each line of the report begins with OK, odd (the configuration deals with it) or missing (the odometry cannot\n"
    "run). docs/your_sensors.md explains each. Exit status: 0 ready, 1 something is missing, 2 wrong arguments.\n"
    "\n"
    "  rosrun rio_t check_bag run.bag --out my.yaml\n"
    "  rosrun rio_t rio_t_bag --bag run.bag --config my.yaml --output-dir results\n"
    "  rosrun rio_t check_bag --live --duration 60 --keep live.bag --out my.yaml\n";

struct Arguments {
  rio_t::CheckRequest request;
  bool live = false, help = false, version = false;
  std::string keep;
};

options::options_description optionsOf(Arguments* arguments) {
  rio_t::CheckRequest& r = arguments->request;
  options::options_description all("Options", 110);
  const auto text = [](std::string* target, const char* name) {
    return options::value<std::string>(target)->value_name(name);
  };
  all.add_options()("out", text(&r.out, "FILE"), "gets the configuration; without it, it is printed")(
      "rig", text(&r.rig, "FILE.png"), "gets a drawing of the rig: top and side view")(
      "imu-topic", text(&r.imu_topic, "TOPIC"), "the IMU; by default the one with most samples")(
      "radar-topic", options::value(&r.radar_topics)->value_name("TOPIC"),
      "a radar; may be repeated; by default all clouds with a Doppler")(
      "duration", options::value<double>(&r.duration)->value_name("S"),
      "seconds to read of each bag (default 120; 0: all), or to listen with --live (default 30)")(
      "no-trial", options::bool_switch(), "do not run the odometry with what is proposed")(
      "live", options::bool_switch(&arguments->live), "listen to the running topics instead of reading a bag")(
      "keep", text(&arguments->keep, "BAG"), "with --live: keep what was heard in this bag")(
      "help,h", options::bool_switch(&arguments->help), "print this")(
      "version", options::bool_switch(&arguments->version), "print the version");
  return all;
}

Arguments parse(int argc, char** argv) {
  Arguments arguments;
  const options::options_description shown = optionsOf(&arguments);
  options::options_description all;
  all.add(shown).add_options()("bag", options::value(&arguments.request.bags));
  options::positional_options_description positional;
  positional.add("bag", -1);
  std::vector<std::string> words;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word.rfind("__", 0) == 0 && word.find(":=") != std::string::npos) continue;  // roslaunch's remappings
    words.push_back(word);
  }
  options::variables_map values;
  options::store(options::command_line_parser(words).options(all).positional(positional).run(), values);
  options::notify(values);
  arguments.request.try_out = !values["no-trial"].as<bool>();
  if (arguments.request.duration < 0.0) throw std::invalid_argument("--duration: expected at least 0");
  if (arguments.live && values.count("duration") == 0) arguments.request.duration = 30.0;
  if (arguments.live && !arguments.request.bags.empty())
    throw std::invalid_argument("expected bags or --live, got both");
  if (!arguments.live && !arguments.keep.empty()) throw std::invalid_argument("--keep: expected --live with it");
  return arguments;
}

/// A folder that is gone at the end.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "rio_t_check_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder can be made");
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

int runLive(Arguments arguments, int argc, char** argv) {
  ros::init(argc, argv, "rio_t_check_bag", ros::init_options::AnonymousName);
  const TemporaryFolder folder;
  const std::string bag = arguments.keep.empty() ? (folder.path() / "live.bag").string() : arguments.keep;
  std::cerr << "check_bag: listening for " << arguments.request.duration << " s; keep still for 3 s, then move\n";
  if (rio_t::recordTopics(bag, arguments.request.duration) == 0)
    throw std::runtime_error("--live: no message of an Imu, PointCloud2 or Header topic came");
  arguments.request.bags = {bag};
  arguments.request.duration = 0.0;
  return rio_t::runCheck(arguments.request, std::cout, std::cerr);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Arguments defaults;
    const Arguments arguments = parse(argc, argv);
    if (arguments.help) {
      std::cout << kHelp << optionsOf(&defaults) << kExamples;
      return 0;
    }
    if (arguments.version) {
      std::cout << "check_bag " RIO_T_VERSION "\n";
      return 0;
    }
    if (arguments.live) return runLive(arguments, argc, argv);
    return rio_t::runCheck(arguments.request, std::cout, std::cerr);
  } catch (const options::error& error) {
    std::cerr << "check_bag: " << error.what() << " (see --help)\n";
    return kUsage;
  } catch (const std::invalid_argument& error) {
    std::cerr << "check_bag: " << error.what() << " (see --help)\n";
    return kUsage;
  } catch (const std::exception& error) {
    std::cerr << "check_bag: " << error.what() << "\n";
    return 1;
  }
}
