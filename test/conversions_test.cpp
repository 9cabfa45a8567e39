#include "rio_t/ros/messages/conversions.h"

#include <gtest/gtest.h>

#include <cmath>

#include "rio_t/core/so3.h"
#include "rio_t/factors/state_block.h"
#include "some_state.h"

namespace rio_t {
namespace {

using S = StateBlock;

template <typename Array>
Covariance6 matrix(const Array& covariance) {
  return Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(covariance.data());
}

TEST(Conversions, TimesKeepEveryNanosecond) {
  const Time time = Time::fromNanoseconds(1700000000123456789);
  EXPECT_EQ(toTime(toRosTime(time)), time);
  EXPECT_EQ(toRosTime(time).sec, 1700000000U);
  EXPECT_EQ(toRosTime(time).nsec, 123456789U);
  EXPECT_THROW(toRosTime(Time::fromNanoseconds(-1)), std::runtime_error);
}

TEST(Conversions, ImuWithoutStampIsRefusedByTopic) {
  sensor_msgs::Imu message;
  message.angular_velocity.y = 2.0;
  message.linear_acceleration.z = 9.8;
  try {
    toImuMeasurement(message, "/my_imu");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("/my_imu"), std::string::npos);
  }
  message.header.stamp = ros::Time(5, 7);
  const ImuMeasurement imu = toImuMeasurement(message, "/my_imu");
  EXPECT_EQ(imu.time.nanoseconds(), 5000000007);
  EXPECT_EQ(imu.angular_velocity, Eigen::Vector3d(0.0, 2.0, 0.0));
  EXPECT_EQ(imu.acceleration, Eigen::Vector3d(0.0, 0.0, 9.8));
}

TEST(Conversions, OdometryHasFramesAndBodyTwist) {
  const NavigationState state = someState();
  const nav_msgs::Odometry odom = toOdometry(bodyOdometry(state, 0.01), "odom", "base_link");
  EXPECT_EQ(odom.header.frame_id, "odom");
  EXPECT_EQ(odom.child_frame_id, "base_link");
  const auto& v = odom.twist.twist.linear;
  const Eigen::Vector3d v_W = state.q_WI * Eigen::Vector3d(v.x, v.y, v.z);
  EXPECT_LT((v_W - state.v_W).norm(), 1e-12);
  EXPECT_EQ(odom.pose.pose.position.z, 3.0);
  EXPECT_NEAR(odom.pose.pose.orientation.w, state.q_WI.w(), 1e-12);
  EXPECT_EQ(odom.twist.twist.angular.x, 0.5);
}

TEST(Conversions, CovariancesHaveTheOrderOfRosAndAreSymmetric) {
  const BodyOdometry body = bodyOdometry(someState(), 0.3);
  const nav_msgs::Odometry odom = toOdometry(body, "o", "b");
  EXPECT_LT((matrix(odom.pose.covariance) - body.pose_covariance).norm(), 1e-12);
  EXPECT_LT((matrix(odom.twist.covariance) - body.twist_covariance).norm(), 1e-12);
  EXPECT_EQ(matrix(odom.pose.covariance), Covariance6(matrix(odom.pose.covariance).transpose()));
}

TEST(Conversions, InvertedTransformIsTheInverse) {
  const NavigationState state = someState();
  const auto there = toTransform(bodyOdometry(state, 0.0), "odom", "base_link", false);
  const auto back = toTransform(bodyOdometry(state, 0.0), "odom", "base_link", true);
  EXPECT_EQ(there.header.frame_id, "odom");
  EXPECT_EQ(there.child_frame_id, "base_link");
  EXPECT_EQ(back.header.frame_id, "base_link");
  EXPECT_EQ(back.child_frame_id, "odom");
  const auto& t = back.transform.translation;
  const auto& q = back.transform.rotation;
  const Eigen::Quaterniond q_IW(q.w, q.x, q.y, q.z);
  EXPECT_LT((q_IW * state.p_W + Eigen::Vector3d(t.x, t.y, t.z)).norm(), 1e-12);
  EXPECT_LT(so3::log(q_IW * state.q_WI).norm(), 1e-12);
}

TEST(Conversions, EgoVelocityKnowsNoRotation) {
  const Eigen::Matrix3d covariance = Eigen::Vector3d(0.01, 0.02, 0.03).asDiagonal();
  const auto message = toTwist({0.1, 1.2, -0.1}, covariance, Time::fromSeconds(7.0), "radar");
  EXPECT_EQ(message.header.frame_id, "radar");
  EXPECT_EQ(message.header.stamp, ros::Time(7.0));
  // Forward is x of the frame (REP-103), and right is minus y.
  EXPECT_NEAR(message.twist.twist.linear.x, 1.2, 1e-12);
  EXPECT_NEAR(message.twist.twist.linear.y, -0.1, 1e-12);
  EXPECT_NEAR(message.twist.covariance[0], 0.02, 1e-12);
  EXPECT_NEAR(message.twist.covariance[7], 0.01, 1e-12);
  for (const std::size_t unknown : {21U, 28U, 35U}) EXPECT_EQ(message.twist.covariance[unknown], 1e6);
}

TEST(Conversions, BiasesCarryTheirSigmas) {
  const NavigationState state = someState();
  const ImuBias message = toImuBias(state, "base_link");
  EXPECT_EQ(message.header.frame_id, "base_link");
  EXPECT_EQ(message.gyroscope[1], -0.02);
  EXPECT_EQ(message.accelerometer[2], -0.3);
  EXPECT_EQ(message.gyroscope_sigma[2], std::sqrt(state.covariance(S::kBg + 2, S::kBg + 2)));
  EXPECT_EQ(message.accelerometer_sigma[0], std::sqrt(state.covariance(S::kBa, S::kBa)));
}

TEST(Conversions, ExtrinsicsAreAPoseWithACovarianceOfTheOrderOfRos) {
  const Extrinsics T_IR{{0.1, 0.2, 0.3}, so3::exp({0.0, 0.0, 0.5})};
  Covariance6 covariance = Covariance6::Zero();
  covariance.diagonal() << 1.0, 2.0, 3.0, 4.0, 5.0, 6.0;
  covariance(0, 5) = covariance(5, 0) = 0.5;
  const auto message = toPose(T_IR, covariance, Time::fromSeconds(7.5), "base_link");
  EXPECT_EQ(message.header.stamp, ros::Time(7, 500000000));
  EXPECT_EQ(message.header.frame_id, "base_link");
  EXPECT_EQ(message.pose.pose.position.y, 0.2);
  EXPECT_EQ(message.pose.pose.orientation.z, T_IR.q_IR.z());
  EXPECT_EQ(message.pose.pose.orientation.w, T_IR.q_IR.w());
  EXPECT_EQ(matrix(message.pose.covariance), covariance);
}

TEST(Conversions, ExtrinsicsFromTfTurnTheCloudsAxes) {
  geometry_msgs::Transform T;
  T.translation.x = 0.1;
  T.translation.z = -0.2;
  T.rotation.w = 1.0;  // the cloud's axes are those of base_link
  const Extrinsics as_is = toExtrinsics(T, PointAxes::kRightForwardUp);
  EXPECT_EQ(as_is.l_I, Eigen::Vector3d(0.1, 0.0, -0.2));
  EXPECT_LT(so3::log(as_is.q_IR).norm(), 1e-12);
  // A point ahead is (1, 0, 0) for a driver with x forward and (0, 1, 0) in RIO axes: the same place in
  // base_link.
  const Extrinsics turned = toExtrinsics(T, PointAxes::kForwardLeftUp);
  EXPECT_LT((turned.q_IR * Eigen::Vector3d::UnitY() - Eigen::Vector3d::UnitX()).norm(), 1e-12);
  EXPECT_LT((turned.q_IR * Eigen::Vector3d::UnitX() + Eigen::Vector3d::UnitY()).norm(), 1e-12);
}

TEST(Conversions, RadarFrameHangsBelowBaseLinkWithTheAxesOfRep103) {
  const ImuInBody T_BI{{0.0, 0.0, 0.5}, so3::exp({0.0, 0.0, 1.2})};
  const Extrinsics T_IR{{0.1, 0.2, 0.3}, so3::exp({0.4, -0.5, 0.6})};
  const auto shown = toTransform(T_IR, T_BI, "base_link", "rio_t_radar");
  EXPECT_EQ(shown.header.frame_id, "base_link");
  EXPECT_EQ(shown.child_frame_id, "rio_t_radar");
  // A point two metres ahead of the radar is at (2, 0, 0) of its frame.
  const auto& q = shown.transform.rotation;
  const auto& t = shown.transform.translation;
  const Eigen::Vector3d at = Eigen::Quaterniond(q.w, q.x, q.y, q.z) * Eigen::Vector3d(2.0, 0.0, 0.0) +
                             Eigen::Vector3d(t.x, t.y, t.z);
  const Eigen::Vector3d expected =
      T_BI.q_BI * (T_IR.q_IR * Eigen::Vector3d(0.0, 2.0, 0.0) + T_IR.l_I) + T_BI.p_B;
  EXPECT_LT((at - expected).norm(), 1e-12);
}

}  // namespace
}  // namespace rio_t
