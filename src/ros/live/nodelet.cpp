#include <nodelet/nodelet.h>
#include <ros/console.h>

#include <memory>
#include <pluginlib/class_list_macros.hpp>

#include "rio_t/ros/live/live_odometry.h"

namespace rio_t {

/// LiveOdometry in a nodelet manager.
class RioTNodelet : public nodelet::Nodelet {
  void onInit() override {
    try {
      odometry_ = std::make_unique<LiveOdometry>(getNodeHandle(), getPrivateNodeHandle(), getName());
    } catch (const std::exception& error) {
      ROS_ERROR_STREAM(getName() << ": " << error.what());
      throw;  // the manager then reports that it could not load
    }
  }

  std::unique_ptr<LiveOdometry> odometry_;
};

}  // namespace rio_t

PLUGINLIB_EXPORT_CLASS(rio_t::RioTNodelet, nodelet::Nodelet)
