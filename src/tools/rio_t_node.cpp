// The live odometry as a node of its own; parameters are private (~), see config/estimator.yaml.
#include <ros/ros.h>

#include <exception>

#include "rio_t/ros/live/live_odometry.h"

int main(int argc, char** argv) {
  ros::init(argc, argv, "rio_t");
  // Outside of try: with the last handle the console goes, and what is wrong would not be told.
  const ros::NodeHandle node;
  const ros::NodeHandle private_node("~");
  try {
    const rio_t::LiveOdometry odometry(node, private_node, ros::this_node::getName());
    ros::spin();
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM(ros::this_node::getName() << ": " << error.what());
    return 1;
  }
  return 0;
}
