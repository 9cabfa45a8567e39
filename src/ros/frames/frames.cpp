#include "rio_t/ros/frames/frames.h"

#include <ros/time.h>

#include <stdexcept>

#include "../text.h"
#include "rio_t/ros/messages/conversions.h"

namespace rio_t {

std::string imuFrame(const Config& config, const std::string& frame_id) {
  const std::string& configured = config.imu_frame.empty() ? frame_id : config.imu_frame;
  return withoutSlash(configured.empty() ? config.base_link_frame : configured);
}

std::string cloudFrame(const Config& radar, const std::string& frame_id) {
  const std::string key = prefixOf(radar.radar_name);
  if (frame_id.empty())
    throw std::runtime_error(
        "topic " + radar.radar_topic +
        ": the cloud has no frame_id, and extrinsics_source is tf; expected one that tf knows, "
        "or " +
        key + "extrinsics_source: parameters");
  std::string frame = withoutSlash(frame_id);
  if (frame == radar.radar_frame && radar.publish_radar_tf)
    throw std::runtime_error(
        key + "radar_frame: \"" + frame +
        "\" is the frame of the clouds, which has its tf from others; expected another name, "
        "or publish_radar_tf: false");
  return frame;
}

Extrinsics radarExtrinsics(const tf2::BufferCore& tf, const Config& radar, const std::string& imu_frame,
                           const std::string& cloud_frame) {
  return toExtrinsics(tf.lookupTransform(imu_frame, cloud_frame, ros::Time(0)).transform,
                      pointCloudFormat(radar).axes);
}

}  // namespace rio_t
