#pragma once

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <geometry_msgs/TwistWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>
#include <sensor_msgs/FluidPressure.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/PointCloud2.h>

#include <string>
#include <vector>

#include "rio_t/ImuBias.h"
#include "rio_t/imu/measurement.h"
#include "rio_t/imu/units.h"
#include "rio_t/landmarks/landmark_answer.h"
#include "rio_t/odometry/navigation_state.h"
#include "rio_t/odometry/options.h"
#include "rio_t/radar/ego_velocity.h"
#include "rio_t/ros/parameters/point_cloud_format.h"
#include "rio_t/sensors/barometer_channel.h"

namespace rio_t {

/// The landmarks, in W: x, y, z, sigma [m], intensity (mean SNR) and sightings. The header is the caller's.
sensor_msgs::PointCloud2 toPointCloud2(const std::vector<LandmarkPoint>& map);

using Covariance6 = Eigen::Matrix<double, 6, 6>;

Time toTime(const ros::Time& time);
/// Throws std::runtime_error for a time that ROS cannot hold (negative, or after 2106).
ros::Time toRosTime(Time time);
/// In m/s^2 and rad/s; `units` are those of the driver. Throws std::runtime_error, naming `topic`, if the stamp
/// in the header is zero.
ImuMeasurement toImuMeasurement(const sensor_msgs::Imu& message, const std::string& topic,
                                const ImuUnits& units = {});

/// Throws std::runtime_error, naming `topic`, where the stamp is zero or the pressure is none (see faultOf).
/// The variance in the message is not read: most drivers leave it at zero.
Pressure toPressure(const sensor_msgs::FluidPressure& message, const std::string& topic);

/// Covariance of position and orientation as nav_msgs/Odometry has it: position, then rotation about the
/// fixed axes of W. The state's theta is a rotation about the axes of I, so theta_W = R_WI theta_I.
Covariance6 poseCovariance(const NavigationState& state);

/// Covariance of the velocity and angular velocity of I, both in I: v_I = R_WI' v_W, so
/// dv_I = R_WI' dv_W + v_I x theta; domega = -db_g + the white noise of a sample, `rate_sigma` [rad/s].
Covariance6 twistCovariance(const NavigationState& state, double rate_sigma);

/// Pose in `odom_frame`, twist in `base_link_frame` (REP-105 names; base_link is the IMU frame).
nav_msgs::Odometry toOdometry(const NavigationState& state, double rate_sigma, const std::string& odom_frame,
                              const std::string& base_link_frame);

/// odom -> base_link, or base_link -> odom where `inverted`: for a tree in which base_link has another
/// parent.
geometry_msgs::TransformStamped toTransform(const NavigationState& state, const std::string& odom_frame,
                                            const std::string& base_link_frame, bool inverted);

/// Velocity of the radar in its own frame (RIO axes). The radar says nothing of the angular velocity: its
/// variances are -1, as in sensor_msgs/Imu for "not known".
geometry_msgs::TwistWithCovarianceStamped toTwist(const EgoVelocity& ego_velocity, Time stamp,
                                                  const std::string& radar_frame);

ImuBias toImuBias(const NavigationState& state, const std::string& base_link_frame);

/// The T_IR that a tf transform from the cloud's frame to base_link stands for. The cloud's frame has the
/// axes of the cloud (`axes`), T_IR those of RIO (x right, y forward, z up).
Extrinsics toExtrinsics(const geometry_msgs::Transform& T_base_cloud, PointAxes axes);
/// T_IR as a pose in `base_link_frame`. `covariance` as ScanResult::T_IR_covariance, which has the order of
/// ROS.
geometry_msgs::PoseWithCovarianceStamped toPose(const Extrinsics& T_IR, const Covariance6& covariance,
                                                Time stamp, const std::string& base_link_frame);
/// T_IR for display: base_link -> radar_frame with RIO axes.
geometry_msgs::TransformStamped toTransform(const Extrinsics& T_IR, const std::string& base_link_frame,
                                            const std::string& radar_frame);

}  // namespace rio_t
