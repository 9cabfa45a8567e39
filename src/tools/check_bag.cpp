// Looks at a bag, or at running topics, and proposes a configuration. See `check_bag --help`.
#include "rio_t/ros/bag/check_bag.h"

#include <ros/ros.h>

#include <filesystem>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "ros/command_line.h"
#include "ros/live/record_topics.h"
#include "ros/temporary_folder.h"

namespace {

namespace fs = std::filesystem;

const rio_t::ProgramText kText = {
    "check_bag",
    "BAG... [--out my.yaml] [--rig rig.png] [--set key=value]...\n"
    "--live [--duration 30] [--out my.yaml]\n",
    "Looks at the IMU and the radars of a bag: topics, rates, stamps, units, axes, sign of the Doppler. It "
    "finds the\n"
    "mounting of each radar and its time offset roughly, writes a configuration, and runs the odometry with "
    "it.\n"
    "Record 3 s at rest, then a minute of motion with turns about all axes.",
    "rosrun rio_t check_bag run.bag --out my.yaml\n"
    "rosrun rio_t rio_t_bag run.bag --config my.yaml --output-dir results\n"
    "rosrun rio_t check_bag run.bag --set radar_field_doppler=v --out my.yaml\n"
    "rosrun rio_t check_bag --live --duration 60 --keep live.bag --out my.yaml\n",
    "Each line of the report begins with OK, odd (the configuration deals with it) or missing (the odometry "
    "cannot\n"
    "run). docs/your_sensors.md explains each.\n"};

struct Arguments {
  rio_t::CheckRequest request;
  std::optional<double> duration;
  bool live = false, no_trial = false;
  std::string keep;
};

void addOptions(rio_t::OptionSet& options, Arguments& a) {
  rio_t::CheckRequest& r = a.request;
  options.values("bag", "BAG",
                 "a bag; `--bag` may be left out; bags that follow one another are one recording",
                 [&r](const std::string& bag) { rio_t::addBag(bag, r.bags); });
  options.positional("bag");
  options.text("out", "FILE.yaml", "gets the configuration; without it, it is printed", r.out);
  options.text("rig", "FILE.png", "gets a drawing of the rig: top and side view", r.rig);
  options.text("imu-topic", "TOPIC", "the IMU; by default the one that can be used, with most samples",
               r.imu_topic);
  options.values("radar-topic", "TOPIC", "a radar; may be repeated; by default all clouds with a Doppler",
                 [&r](const std::string& topic) { r.radar_topics.push_back(topic); });
  options.values(
      "set", "key=value",
      "a parameter that you know, such as a field of the cloud; it goes into the configuration; may be "
      "repeated",
      [&r](const std::string& text) { r.set.push_back(rio_t::parseAssignment(text)); });
  options.value("duration", "S", "seconds to read of each recording (0: all), or to listen with --live",
                "120; 30 live", [&a](const std::string& text) {
                  a.duration = rio_t::parseNumber(text, rio_t::NumberRange::kNotNegative);
                });
  options.flag("no-trial", "do not run the odometry with the configuration", a.no_trial);
  options.flag("live", "listen to the running topics instead of reading a bag", a.live);
  options.text("keep", "BAG", "with --live: keep the messages in this new bag", a.keep);
}

int runLive(rio_t::CheckRequest request, double duration, const std::string& keep) {
  if (fs::exists(keep)) throw rio_t::UsageError("--keep " + keep + ": expected a new file, this one exists");
  const rio_t::TemporaryFolder folder;
  const std::string bag = keep.empty() ? folder.path() + "/live.bag" : keep;
  request.bags = {bag};
  request.bags_go_away = keep.empty();
  request.duration = 0.0;
  rio_t::validate(request);
  int argc = 0;
  ros::init(argc, nullptr, "rio_t_check_bag", ros::init_options::AnonymousName);
  std::cerr << "check_bag: listening for " << duration << " s; keep still for 3 s, then move\n";
  if (rio_t::recordTopics(bag, duration) == 0)
    throw std::runtime_error(
        "--live: no message of an Imu, PointCloud2, Header, FluidPressure or tf topic came");
  return rio_t::runCheck(request, std::cout);
}

int run(Arguments arguments) {
  rio_t::CheckRequest& request = arguments.request;
  request.try_out = !arguments.no_trial;
  if (arguments.live && !request.bags.empty()) throw rio_t::UsageError("expected bags or --live, got both");
  if (!arguments.live && !arguments.keep.empty()) throw rio_t::UsageError("--keep: expected --live with it");
  constexpr double kListen = 30.0;  // [s]
  if (arguments.live) return runLive(request, arguments.duration.value_or(kListen), arguments.keep);
  request.duration = arguments.duration.value_or(request.duration);
  return rio_t::runCheck(request, std::cout);
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  rio_t::OptionSet options("Options");
  addOptions(options, arguments);
  return rio_t::runProgram(kText, options, std::vector<std::string>(argv + 1, argv + argc), std::cout,
                           std::cerr, [&] { return run(arguments); });
}
