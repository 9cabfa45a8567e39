// The live odometry as a node of its own; parameters are private (~), see docs/parameters.md.
#include <ros/ros.h>

#include <algorithm>
#include <csignal>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "../ros/command_line.h"
#include "rio_t/ros/live/live_odometry.h"
#include "rio_t/ros/parameters/parameters.h"

namespace {

const rio_t::ProgramText kText = {"rio_t_node", "[_config:=NAME_OR_PATH] [_KEY:=VALUE]...\n",
                                  "Runs the radar-inertial odometry live, as a ROS node. It needs a roscore.",
                                  "rosrun rio_t rio_t_node _config:=irs\n"
                                  "rosrun rio_t rio_t_node _config:=$PWD/my.yaml _stamp_source:=arrival\n"
                                  "roslaunch rio_t rio_t.launch config:=irs\n",
                                  "Parameters are private; docs/parameters.md describes every key. "
                                  "docs/ros.md lists topics and services.\n"};

/// ROS takes NAME:=VALUE for the remapping of a topic, and ignores it silently if there is no such topic.
void refuseParametersAsRemappings(int argc, char** argv) {
  std::vector<std::string> keys = {"config"};
  for (const rio_t::ParameterDescription& each : rio_t::parameterDescriptions()) keys.push_back(each.key);
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (std::find(keys.begin(), keys.end(), word.substr(0, word.find(":="))) != keys.end())
      throw rio_t::UsageError(word + ": a parameter is set with an underscore, _" + word);
  }
}

int spin() {
  // Outside of try: rosconsole ends with the last handle, and would lose the message below.
  const ros::NodeHandle node;
  const ros::NodeHandle private_node("~");
  // roscpp only handles SIGINT. Docker, systemd and kill send SIGTERM: without an orderly end, the master
  // would keep our topics and services.
  std::signal(SIGTERM, [](int) { ros::requestShutdown(); });
  try {
    const rio_t::LiveOdometry odometry(node, private_node, ros::this_node::getName());
    ros::spin();
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM(ros::this_node::getName() << ": " << error.what());
    return rio_t::kExitFailed;
  }
  return rio_t::kExitOk;
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> words;
  ros::removeROSArgs(argc, argv, words);
  words.erase(words.begin());  // the program itself
  rio_t::OptionSet options("Options");
  return rio_t::runProgram(kText, options, words, std::cout, std::cerr, [&] {
    refuseParametersAsRemappings(argc, argv);
    ros::init(argc, argv, "rio_t");
    return spin();
  });
}
