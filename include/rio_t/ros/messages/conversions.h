#pragma once

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <geometry_msgs/TwistWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>
#include <sensor_msgs/FluidPressure.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Header.h>

#include <string>
#include <vector>

#include "rio_t/ImuBias.h"
#include "rio_t/imu/measurement.h"
#include "rio_t/imu/units.h"
#include "rio_t/landmarks/landmark_answer.h"
#include "rio_t/odometry/body_odometry.h"
#include "rio_t/odometry/navigation_state.h"
#include "rio_t/odometry/options.h"
#include "rio_t/radar/extrinsics.h"
#include "rio_t/ros/parameters/point_cloud_format.h"
#include "rio_t/sensors/barometer_channel.h"

namespace rio_t {

/// Converts the landmarks to a cloud in the odometry frame: x, y, z, sigma [m], intensity (mean SNR),
/// sightings. Without header.
sensor_msgs::PointCloud2 toPointCloud2(const std::vector<LandmarkPoint>& map, const WorldInOdom& T_OW = {});

Time toTime(const ros::Time& time);
/// Throws std::runtime_error for a time that ROS cannot hold (negative, or after 2106).
ros::Time toRosTime(Time time);
/// Throws likewise.
std_msgs::Header toHeader(Time stamp, const std::string& frame, std::uint32_t seq = 0);
/// Converts to m/s^2 and rad/s; `units` are those of the driver. Throws std::runtime_error that names `topic`
/// if the stamp in the header is zero.
ImuMeasurement toImuMeasurement(const sensor_msgs::Imu& message, const std::string& topic,
                                const ImuUnits& units = {});

/// Throws std::runtime_error that names `topic` if the stamp is zero or the value is no pressure (see
/// faultOf). The variance in the message is not read: most drivers leave it at zero.
Pressure toPressure(const sensor_msgs::FluidPressure& message, const std::string& topic);

/// Pose in `odom_frame`, twist in `base_link_frame` (REP-105 names).
nav_msgs::Odometry toOdometry(const BodyOdometry& body, const std::string& odom_frame,
                              const std::string& base_link_frame);

/// odom -> base_link, or base_link -> odom if `inverted`: for a tree in which base_link has another parent.
geometry_msgs::TransformStamped toTransform(const BodyOdometry& body, const std::string& odom_frame,
                                            const std::string& base_link_frame, bool inverted);

/// [m^2, rad^2, ...] Variance of an entry that nobody measured. It is not the -1 of sensor_msgs/Imu: filters
/// (robot_localization) take a covariance as it is, and a negative variance is invalid. 1e6 is far above the
/// square of any value that a platform can have, and a filter can still invert it beside variances of 1e-6.
constexpr double kUnknownVariance = 1e6;

/// Converts a velocity `v_R` in the radar's axes, with its covariance, to `radar_frame` (x forward, y left, z
/// up). The radar does not measure the angular velocity: it is zero with kUnknownVariance.
geometry_msgs::TwistWithCovarianceStamped toTwist(const Eigen::Vector3d& v_R,
                                                  const Eigen::Matrix3d& covariance, Time stamp,
                                                  const std::string& radar_frame);

ImuBias toImuBias(const NavigationState& state, const std::string& imu_frame);

/// Converts a tf transform from the cloud's frame to the IMU to T_IR. The cloud's frame has the axes of the
/// cloud (`axes`), T_IR those of RIO (x right, y forward, z up).
Extrinsics toExtrinsics(const geometry_msgs::Transform& T_imu_cloud, PointAxes axes);
/// Converts a tf transform from the IMU to base_link to T_BI.
ImuInBody toImuInBody(const geometry_msgs::Transform& T_base_imu);
/// T_IR as a pose in `imu_frame`. `covariance` as ScanResult::T_IR_covariance, which has the order of ROS.
geometry_msgs::PoseWithCovarianceStamped toPose(const Extrinsics& T_IR, const Covariance6& covariance,
                                                Time stamp, const std::string& imu_frame);
/// base_link -> radar_frame (x forward, y left, z up).
geometry_msgs::TransformStamped toTransform(const Extrinsics& T_IR, const ImuInBody& T_BI,
                                            const std::string& base_link_frame,
                                            const std::string& radar_frame);

}  // namespace rio_t
