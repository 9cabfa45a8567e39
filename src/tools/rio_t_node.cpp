// The live odometry as a node of its own; parameters are private (~), see docs/parameters.md.
#include <ros/ros.h>

#include <exception>
#include <iostream>

#include "../ros/command_line.h"
#include "rio_t/ros/live/live_odometry.h"

namespace {

const rio_t::ProgramText kText = {"rio_t_node", "[_config:=NAME_OR_PATH] [_KEY:=VALUE]...\n",
                                  "Runs the radar-inertial odometry live, as a ROS node. It needs a roscore.",
                                  "rosrun rio_t rio_t_node _config:=irs\n"
                                  "rosrun rio_t rio_t_node _config:=$PWD/my.yaml _stamp_source:=arrival\n"
                                  "roslaunch rio_t rio_t.launch config:=irs\n",
                                  "Parameters are private; docs/parameters.md describes every key. "
                                  "docs/ros.md lists topics and services.\n"};

int spin() {
  // Outside of try: the console goes with the last handle, and the message would be lost.
  const ros::NodeHandle node;
  const ros::NodeHandle private_node("~");
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
    ros::init(argc, argv, "rio_t");
    return spin();
  });
}
