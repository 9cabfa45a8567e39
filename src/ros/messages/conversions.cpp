#include "rio_t/ros/messages/conversions.h"

#include <sensor_msgs/point_cloud2_iterator.h>

#include <tf2_eigen/tf2_eigen.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "rio_t/core/so3.h"
#include "rio_t/factors/state_block.h"

namespace rio_t {
namespace {

using S = StateBlock;

template <typename Array>
void assign(const Covariance6& from, Array* to) {
  // Symmetric in theory; in the message also to the last bit.
  Eigen::Map<Covariance6>(to->data()) = 0.5 * (from + from.transpose());
}

}  // namespace

Time toTime(const ros::Time& time) { return Time::fromNanoseconds(static_cast<std::int64_t>(time.toNSec())); }

ros::Time toRosTime(Time time) {
  constexpr std::int64_t kSecond = 1000000000;
  const std::int64_t ns = time.nanoseconds();
  if (ns < 0 || ns / kSecond > std::numeric_limits<std::uint32_t>::max())
    throw std::runtime_error("stamp of " + std::to_string(time.seconds()) +
                             " s: not a time that ROS can hold");
  return {static_cast<std::uint32_t>(ns / kSecond), static_cast<std::uint32_t>(ns % kSecond)};
}

ImuMeasurement toImuMeasurement(const sensor_msgs::Imu& message, const std::string& topic,
                                const ImuUnits& units) {
  ImuMeasurement imu;
  imu.time = toTime(message.header.stamp);
  if (imu.time == Time()) throw std::runtime_error("topic " + topic + ": the stamp in the header is zero");
  tf2::fromMsg(message.angular_velocity, imu.angular_velocity);
  tf2::fromMsg(message.linear_acceleration, imu.acceleration);
  return converted(imu, units);
}

Pressure toPressure(const sensor_msgs::FluidPressure& message, const std::string& topic) {
  const Pressure pressure{toTime(message.header.stamp), message.fluid_pressure};
  if (pressure.time == Time())
    throw std::runtime_error("topic " + topic + ": the stamp in the header is zero");
  const std::string fault = faultOf(pressure.pascal);
  if (!fault.empty()) throw std::runtime_error("topic " + topic + ": fluid_pressure: " + fault);
  return pressure;
}

Covariance6 poseCovariance(const NavigationState& state) {
  Eigen::Matrix<double, 6, 15> J = Eigen::Matrix<double, 6, 15>::Zero();
  J.block<3, 3>(0, S::kP).setIdentity();
  J.block<3, 3>(3, S::kTheta) = state.q_WI.toRotationMatrix();
  return J * state.covariance * J.transpose();
}

Covariance6 twistCovariance(const NavigationState& state, double rate_sigma) {
  const Eigen::Matrix3d R_IW = state.q_WI.conjugate().toRotationMatrix();
  Eigen::Matrix<double, 6, 15> J = Eigen::Matrix<double, 6, 15>::Zero();
  J.block<3, 3>(0, S::kTheta) = so3::hat(R_IW * state.v_W);
  J.block<3, 3>(0, S::kV) = R_IW;
  J.block<3, 3>(3, S::kBg) = -Eigen::Matrix3d::Identity();
  Covariance6 covariance = J * state.covariance * J.transpose();
  covariance.diagonal().tail<3>().array() += rate_sigma * rate_sigma;
  return covariance;
}

nav_msgs::Odometry toOdometry(const NavigationState& state, double rate_sigma, const std::string& odom_frame,
                              const std::string& base_link_frame) {
  nav_msgs::Odometry message;
  message.header.stamp = toRosTime(state.time);
  message.header.frame_id = odom_frame;
  message.child_frame_id = base_link_frame;
  message.pose.pose.position = tf2::toMsg(state.p_W);
  message.pose.pose.orientation = tf2::toMsg(state.q_WI);
  assign(poseCovariance(state), &message.pose.covariance);
  tf2::toMsg(state.q_WI.conjugate() * state.v_W, message.twist.twist.linear);
  tf2::toMsg(state.angular_velocity, message.twist.twist.angular);
  assign(twistCovariance(state, rate_sigma), &message.twist.covariance);
  return message;
}

geometry_msgs::TransformStamped toTransform(const NavigationState& state, const std::string& odom_frame,
                                            const std::string& base_link_frame, bool inverted) {
  geometry_msgs::TransformStamped transform;
  transform.header.stamp = toRosTime(state.time);
  transform.header.frame_id = inverted ? base_link_frame : odom_frame;
  transform.child_frame_id = inverted ? odom_frame : base_link_frame;
  const Eigen::Quaterniond q = inverted ? state.q_WI.conjugate() : state.q_WI;
  tf2::toMsg(inverted ? Eigen::Vector3d(-(q * state.p_W)) : state.p_W, transform.transform.translation);
  transform.transform.rotation = tf2::toMsg(q);
  return transform;
}

geometry_msgs::TwistWithCovarianceStamped toTwist(const EgoVelocity& ego_velocity, Time stamp,
                                                  const std::string& radar_frame) {
  geometry_msgs::TwistWithCovarianceStamped message;
  message.header.stamp = toRosTime(stamp);
  message.header.frame_id = radar_frame;
  tf2::toMsg(ego_velocity.v_R, message.twist.twist.linear);
  Covariance6 covariance = -Covariance6::Identity();
  covariance.topLeftCorner<3, 3>() = ego_velocity.covariance;
  assign(covariance, &message.twist.covariance);
  return message;
}

ImuBias toImuBias(const NavigationState& state, const std::string& base_link_frame) {
  ImuBias message;
  message.header.stamp = toRosTime(state.time);
  message.header.frame_id = base_link_frame;
  for (int axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    message.gyroscope[k] = state.b_g[axis];
    message.accelerometer[k] = state.b_a[axis];
    message.gyroscope_sigma[k] = std::sqrt(std::max(0.0, state.covariance(S::kBg + axis, S::kBg + axis)));
    message.accelerometer_sigma[k] = std::sqrt(std::max(0.0, state.covariance(S::kBa + axis, S::kBa + axis)));
  }
  return message;
}

Extrinsics toExtrinsics(const geometry_msgs::Transform& T_base_cloud, PointAxes axes) {
  const Eigen::Quaterniond q_cloud_R = cloudFromRfu(axes);
  Eigen::Quaterniond q_base_cloud;
  tf2::fromMsg(T_base_cloud.rotation, q_base_cloud);
  Extrinsics T_IR;
  tf2::fromMsg(T_base_cloud.translation, T_IR.l_I);
  T_IR.q_IR = (q_base_cloud.normalized() * q_cloud_R).normalized();
  return T_IR;
}

geometry_msgs::PoseWithCovarianceStamped toPose(const Extrinsics& T_IR, const Covariance6& covariance,
                                                Time stamp, const std::string& base_link_frame) {
  geometry_msgs::PoseWithCovarianceStamped message;
  message.header.stamp = toRosTime(stamp);
  message.header.frame_id = base_link_frame;
  message.pose.pose.position = tf2::toMsg(T_IR.l_I);
  message.pose.pose.orientation = tf2::toMsg(T_IR.q_IR);
  assign(covariance, &message.pose.covariance);
  return message;
}

geometry_msgs::TransformStamped toTransform(const Extrinsics& T_IR, const std::string& base_link_frame,
                                            const std::string& radar_frame) {
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = base_link_frame;
  transform.child_frame_id = radar_frame;
  tf2::toMsg(T_IR.l_I, transform.transform.translation);
  transform.transform.rotation = tf2::toMsg(T_IR.q_IR);
  return transform;
}

sensor_msgs::PointCloud2 toPointCloud2(const std::vector<LandmarkPoint>& map) {
  sensor_msgs::PointCloud2 cloud;
  cloud.height = 1;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  constexpr auto kFloat = sensor_msgs::PointField::FLOAT32;
  modifier.setPointCloud2Fields(6, "x", 1, kFloat, "y", 1, kFloat, "z", 1, kFloat, "sigma", 1, kFloat,
                                "intensity", 1, kFloat, "sightings", 1, kFloat);
  modifier.resize(map.size());
  sensor_msgs::PointCloud2Iterator<float> field(cloud, "x");
  for (const LandmarkPoint& point : map) {
    for (int i = 0; i < 3; ++i) field[i] = static_cast<float>(point.p_W[i]);
    field[3] = static_cast<float>(point.sigma);
    field[4] = static_cast<float>(point.snr_db);
    field[5] = static_cast<float>(point.sightings);
    ++field;
  }
  return cloud;
}

}  // namespace rio_t
