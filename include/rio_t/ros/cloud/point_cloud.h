#pragma once

#include <pcl/point_cloud.h>
#include <sensor_msgs/PointCloud2.h>

#include <cstddef>
#include <string>
#include <vector>

#include "rio_t/radar/scan.h"
#include "rio_t/ros/cloud/radar_point.h"
#include "rio_t/ros/parameters/point_cloud_format.h"

namespace rio_t {

struct DecodedScan {
  pcl::PointCloud<RadarPointPcl> cloud;  ///< finite points, RIO axes
  std::size_t padding = 0;             ///< points at range zero, or whose position is all NaN; not in `cloud`
  std::size_t dropped_not_finite = 0;  ///< other points with a NaN or an infinity; likewise
};

/// Decodes a cloud. It trusts no size in the message: throws std::runtime_error if a field is missing, or if
/// the data do not hold the points that the message declares. The text lists the fields received, the presets
/// known and those that fit. Points with which a driver fills its cloud up to a fixed size (padding) are no
/// detections.
DecodedScan decode(const sensor_msgs::PointCloud2& message, const PointCloudFormat& format);

/// Converts a power to a signal to noise ratio [dB]; kUnknownSnrDb for PowerUnit::kNotSnr.
double toDecibel(double power, PowerUnit unit);

/// Returns the presets whose fields the cloud has. The power field counts even if a preset does not read it,
/// since its name tells drivers apart.
std::vector<std::string> fittingPresets(const sensor_msgs::PointCloud2& message);

std::vector<std::string> fieldNames(const sensor_msgs::PointCloud2& message);

/// Converts a cloud to a scan, and marks its ambiguous points. `stamp` is the time of the scan in the IMU
/// clock.
RadarScan toRadarScan(const pcl::PointCloud<RadarPointPcl>& cloud, Time stamp);

/// Converts the chosen points (indices into scan.points) to a cloud for display, with the fields x y z
/// doppler snr_db in the axes of `radar_frame` (x forward, y left, z up). The caller sets the header. Throws
/// std::out_of_range for an index past the end.
sensor_msgs::PointCloud2 toPointCloud2(const RadarScan& scan, const std::vector<std::size_t>& indices);

}  // namespace rio_t
