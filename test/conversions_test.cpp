#include "rio_t/ros/messages/conversions.h"

#include <gtest/gtest.h>

#include <functional>

#include "rio_t/core/so3.h"
#include "rio_t/factors/state_block.h"

namespace rio_t {
namespace {

using S = StateBlock;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Vector15 = Eigen::Matrix<double, 15, 1>;

NavigationState someState() {
  NavigationState state;
  state.time = Time::fromNanoseconds(1700000000123456789);
  state.q_WI = so3::exp({0.3, -0.8, 1.9});
  state.p_W = {1.0, -2.0, 3.0};
  state.v_W = {0.7, 1.1, -0.4};
  state.b_g = {0.01, -0.02, 0.03};
  state.b_a = {0.1, 0.2, -0.3};
  state.angular_velocity = {0.5, -0.6, 0.7};
  // Positive definite with every block correlated.
  StateCovariance L = StateCovariance::Zero();
  for (int row = 0; row < 15; ++row) {
    for (int column = 0; column <= row; ++column) L(row, column) = 0.1 * std::sin(1.0 + 3.0 * row + column);
    L(row, row) += 0.2;
  }
  state.covariance = L * L.transpose();
  return state;
}

/// The state moved by an error, in the order and sense of StateCovariance.
NavigationState moved(NavigationState state, const Vector15& error) {
  state.q_WI = state.q_WI * so3::exp(error.segment<3>(S::kTheta));
  state.p_W += error.segment<3>(S::kP);
  state.v_W += error.segment<3>(S::kV);
  state.angular_velocity -= error.segment<3>(S::kBg);
  return state;
}

/// J P J' with a numeric J of what the message says.
Covariance6 propagated(const std::function<Vector6(const NavigationState&)>& said) {
  const NavigationState state = someState();
  Eigen::Matrix<double, 6, 15> J;
  constexpr double kStep = 1e-6;
  for (int k = 0; k < 15; ++k) {
    const Vector15 error = kStep * Vector15::Unit(k);
    J.col(k) = (said(moved(state, error)) - said(moved(state, -error))) / (2.0 * kStep);
  }
  return J * state.covariance * J.transpose();
}

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
  const nav_msgs::Odometry odom = toOdometry(state, 0.01, "odom", "base_link");
  EXPECT_EQ(odom.header.frame_id, "odom");
  EXPECT_EQ(odom.child_frame_id, "base_link");
  const auto& v = odom.twist.twist.linear;
  const Eigen::Vector3d v_W = state.q_WI * Eigen::Vector3d(v.x, v.y, v.z);
  EXPECT_LT((v_W - state.v_W).norm(), 1e-12);
  EXPECT_EQ(odom.pose.pose.position.z, 3.0);
  EXPECT_EQ(odom.pose.pose.orientation.w, state.q_WI.w());
  EXPECT_EQ(odom.twist.twist.angular.x, 0.5);
}

TEST(Conversions, PoseCovarianceIsAboutTheFixedAxes) {
  const Eigen::Quaterniond q_0 = someState().q_WI;
  const Covariance6 expected = propagated([&](const NavigationState& x) {
    Vector6 said;
    said << x.p_W, so3::log(x.q_WI * q_0.conjugate());
    return said;
  });
  const Covariance6 covariance = matrix(toOdometry(someState(), 0.01, "o", "b").pose.covariance);
  EXPECT_LT((covariance - expected).norm(), 1e-8 * expected.norm());
  EXPECT_EQ(covariance, Covariance6(covariance.transpose()));
}

TEST(Conversions, TwistCovarianceIsOfTheBodyVelocity) {
  Covariance6 expected = propagated([](const NavigationState& x) {
    Vector6 said;
    said << x.q_WI.conjugate() * x.v_W, x.angular_velocity;
    return said;
  });
  expected.diagonal().tail<3>().array() += 0.3 * 0.3;
  const Covariance6 covariance = matrix(toOdometry(someState(), 0.3, "o", "b").twist.covariance);
  EXPECT_LT((covariance - expected).norm(), 1e-8 * expected.norm());
  EXPECT_GT(covariance.llt().matrixL().determinant(), 0.0);
}

TEST(Conversions, InvertedTransformIsTheInverse) {
  const NavigationState state = someState();
  const auto there = toTransform(state, "odom", "base_link", false);
  const auto back = toTransform(state, "odom", "base_link", true);
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
  EgoVelocity ego;
  ego.v_R = {0.1, 1.2, -0.1};
  ego.covariance = Eigen::Vector3d(0.01, 0.02, 0.03).asDiagonal();
  const auto message = toTwist(ego, Time::fromSeconds(7.0), "radar");
  EXPECT_EQ(message.header.frame_id, "radar");
  EXPECT_EQ(message.header.stamp, ros::Time(7.0));
  EXPECT_EQ(message.twist.twist.linear.y, 1.2);
  EXPECT_EQ(message.twist.covariance[7], 0.02);
  EXPECT_EQ(message.twist.covariance[21], -1.0);
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
  const auto shown = toTransform(turned, "base_link", "radar");
  EXPECT_EQ(shown.child_frame_id, "radar");
  EXPECT_EQ(shown.transform.translation.z, -0.2);
}

}  // namespace
}  // namespace rio_t
