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
  std::size_t padding = 0;               ///< points at range zero or with no position but NaN; not in `cloud`
  std::size_t dropped_not_finite = 0;    ///< other points with a NaN or an infinity; likewise
};

/// Decodes a cloud. No size in the message is trusted: throws std::runtime_error, with the fields received,
/// the presets known and the one that fits, where a field is missing or the layout does not hold the points
/// it declares. Some drivers fill their clouds up to a fixed size: that padding is no detection.
DecodedScan decode(const sensor_msgs::PointCloud2& message, const PointCloudFormat& format);

/// Converts a power in that unit to a signal to noise ratio [dB]; kUnknownSnrDb if the unit is of no ratio.
double toDecibel(double power, PowerUnit unit);

/// The presets whose fields the cloud has. The field of the power counts even where it is not read: its name
/// tells drivers apart.
std::vector<std::string> fittingPresets(const sensor_msgs::PointCloud2& message);

/// For the estimator, with the ambiguous points marked. `stamp` is the scan's time in the IMU clock.
RadarScan toRadarScan(const pcl::PointCloud<RadarPointPcl>& cloud, Time stamp);

/// The chosen points (indices into scan.points) as a cloud of fields x y z doppler snr_db, in the axes of
/// `radar_frame` (x forward, y left, z up), for display. An index past the end throws std::out_of_range. The
/// header is left to the caller.
sensor_msgs::PointCloud2 toPointCloud2(const RadarScan& scan, const std::vector<std::size_t>& indices);

}  // namespace rio_t
