#pragma once

#include <tf2/buffer_core.h>

#include <string>

#include "rio_t/radar/extrinsics.h"
#include "rio_t/ros/parameters/config.h"

/// Looks up the mountings of the sensors in tf, for the live node and the bag runner (docs/frames.md).
namespace rio_t {

/// The frame of the IMU: the parameter `imu_frame`, else the frame_id of the IMU's messages, else
/// base_link_frame. A leading slash, as tf1 had it, is left out.
std::string imuFrame(const Config& config, const std::string& frame_id);

/// The frame of a radar's clouds for tf. Throws std::runtime_error, naming topic and key, if the cloud has no
/// frame_id, or if it is the radar_frame that the live node publishes itself.
std::string cloudFrame(const Config& radar, const std::string& frame_id);

/// T_IR of the clouds in `cloud_frame`, whose axes are those of the radar's format. Throws
/// tf2::TransformException if tf does not connect the two.
Extrinsics radarExtrinsics(const tf2::BufferCore& tf, const Config& radar, const std::string& imu_frame,
                           const std::string& cloud_frame);

}  // namespace rio_t
