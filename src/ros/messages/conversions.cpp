#include "rio_t/ros/messages/conversions.h"

#include <sensor_msgs/point_cloud2_iterator.h>
#include <tf2_eigen/tf2_eigen.h>

#include <limits>
#include <stdexcept>

#include "rio_t/core/sigmas.h"
#include "rio_t/factors/state_block.h"
#include "rio_t/radar/mounting.h"

namespace rio_t {
namespace {

template <typename Array>
void assign(const Covariance6& from, Array* to) {
  // A covariance is symmetric up to rounding; the message is symmetric to the last bit.
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

std_msgs::Header toHeader(Time stamp, const std::string& frame, std::uint32_t seq) {
  std_msgs::Header header;
  header.seq = seq;
  header.stamp = toRosTime(stamp);
  header.frame_id = frame;
  return header;
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

nav_msgs::Odometry toOdometry(const BodyOdometry& body, const std::string& odom_frame,
                              const std::string& base_link_frame) {
  nav_msgs::Odometry message;
  message.header = toHeader(body.time, odom_frame);
  message.child_frame_id = base_link_frame;
  message.pose.pose.position = tf2::toMsg(body.p_O);
  message.pose.pose.orientation = tf2::toMsg(body.q_OB);
  assign(body.pose_covariance, &message.pose.covariance);
  tf2::toMsg(body.v_B, message.twist.twist.linear);
  tf2::toMsg(body.omega_B, message.twist.twist.angular);
  assign(body.twist_covariance, &message.twist.covariance);
  return message;
}

geometry_msgs::TransformStamped toTransform(const BodyOdometry& body, const std::string& odom_frame,
                                            const std::string& base_link_frame, bool inverted) {
  geometry_msgs::TransformStamped transform;
  transform.header = toHeader(body.time, inverted ? base_link_frame : odom_frame);
  transform.child_frame_id = inverted ? odom_frame : base_link_frame;
  const Eigen::Quaterniond q = inverted ? body.q_OB.conjugate() : body.q_OB;
  tf2::toMsg(inverted ? Eigen::Vector3d(-(q * body.p_O)) : body.p_O, transform.transform.translation);
  transform.transform.rotation = tf2::toMsg(q);
  return transform;
}

geometry_msgs::TwistWithCovarianceStamped toTwist(const Eigen::Vector3d& v_R,
                                                  const Eigen::Matrix3d& covariance, Time stamp,
                                                  const std::string& radar_frame) {
  geometry_msgs::TwistWithCovarianceStamped message;
  message.header = toHeader(stamp, radar_frame);
  const Eigen::Matrix3d axes = fluFromRfu().toRotationMatrix();
  tf2::toMsg(Eigen::Vector3d(axes * v_R), message.twist.twist.linear);
  Covariance6 both = kUnknownVariance * Covariance6::Identity();
  both.topLeftCorner<3, 3>() = axes * covariance * axes.transpose();
  assign(both, &message.twist.covariance);
  return message;
}

ImuBias toImuBias(const NavigationState& state, const std::string& imu_frame) {
  ImuBias message;
  message.header = toHeader(state.time, imu_frame);
  const auto sigmas = sigmasOf(state.covariance);
  for (int axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    message.gyroscope[k] = state.b_g[axis];
    message.accelerometer[k] = state.b_a[axis];
    message.gyroscope_sigma[k] = sigmas[StateBlock::kBg + axis];
    message.accelerometer_sigma[k] = sigmas[StateBlock::kBa + axis];
  }
  return message;
}

Extrinsics toExtrinsics(const geometry_msgs::Transform& T_imu_cloud, PointAxes axes) {
  const Eigen::Quaterniond q_cloud_R = cloudFromRfu(axes);
  Eigen::Quaterniond q_imu_cloud;
  tf2::fromMsg(T_imu_cloud.rotation, q_imu_cloud);
  Extrinsics T_IR;
  tf2::fromMsg(T_imu_cloud.translation, T_IR.l_I);
  T_IR.q_IR = (q_imu_cloud.normalized() * q_cloud_R).normalized();
  return T_IR;
}

ImuInBody toImuInBody(const geometry_msgs::Transform& T_base_imu) {
  ImuInBody T_BI;
  tf2::fromMsg(T_base_imu.translation, T_BI.p_B);
  tf2::fromMsg(T_base_imu.rotation, T_BI.q_BI);
  T_BI.q_BI.normalize();
  return T_BI;
}

geometry_msgs::PoseWithCovarianceStamped toPose(const Extrinsics& T_IR, const Covariance6& covariance,
                                                Time stamp, const std::string& imu_frame) {
  geometry_msgs::PoseWithCovarianceStamped message;
  message.header = toHeader(stamp, imu_frame);
  message.pose.pose.position = tf2::toMsg(T_IR.l_I);
  message.pose.pose.orientation = tf2::toMsg(T_IR.q_IR);
  assign(covariance, &message.pose.covariance);
  return message;
}

geometry_msgs::TransformStamped toTransform(const Extrinsics& T_IR, const ImuInBody& T_BI,
                                            const std::string& base_link_frame,
                                            const std::string& radar_frame) {
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = base_link_frame;
  transform.child_frame_id = radar_frame;
  tf2::toMsg(Eigen::Vector3d(T_BI.p_B + T_BI.q_BI * T_IR.l_I), transform.transform.translation);
  transform.transform.rotation = tf2::toMsg((T_BI.q_BI * T_IR.q_IR * fluFromRfu().conjugate()).normalized());
  return transform;
}

sensor_msgs::PointCloud2 toPointCloud2(const std::vector<LandmarkPoint>& map, const WorldInOdom& T_OW) {
  sensor_msgs::PointCloud2 cloud;
  cloud.height = 1;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  constexpr auto kFloat = sensor_msgs::PointField::FLOAT32;
  modifier.setPointCloud2Fields(6, "x", 1, kFloat, "y", 1, kFloat, "z", 1, kFloat, "sigma", 1, kFloat,
                                "intensity", 1, kFloat, "sightings", 1, kFloat);
  modifier.resize(map.size());
  if (map.empty()) return cloud;  // an iterator needs a first byte
  sensor_msgs::PointCloud2Iterator<float> field(cloud, "x");
  for (const LandmarkPoint& point : map) {
    const Eigen::Vector3d p_O = T_OW.p_O + T_OW.q_OW * point.p_W;
    for (int i = 0; i < 3; ++i) field[i] = static_cast<float>(p_O[i]);
    field[3] = static_cast<float>(point.sigma);
    field[4] = static_cast<float>(point.snr_db);
    field[5] = static_cast<float>(point.sightings);
    ++field;
  }
  return cloud;
}

}  // namespace rio_t
