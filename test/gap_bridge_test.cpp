#include "rio_t/imu/gap_bridge.h"

#include <gtest/gtest.h>

#include <cmath>

#include "rio_t/core/so3.h"

namespace rio_t {
namespace {

// The bridge does not know the motion within a gap, but gravity acts all the time.
TEST(GapBridge, OverALongGapGravityTurnsWithThePlatformAndTheRestDiesAway) {
  const double tau = kMotionCorrelationTime;
  GapBridge bridge;
  ImuMeasurement imu;
  const Eigen::Vector3d gravity(0.0, 6.0, 7.0);
  for (int i = 0; i < 2000; ++i) {
    imu.time = Time::fromNanoseconds(1) + 0.005 * i;
    imu.acceleration = gravity;
    bridge.follow(imu);
  }
  imu.time = imu.time + 0.005;
  imu.acceleration = gravity + Eigen::Vector3d(4.0, 0.0, 0.0);
  imu.angular_velocity = {0.0, 0.0, 2.0};
  bridge.follow(imu);
  ImuMeasurement next = imu;
  next.time = imu.time + 2.5;
  next.acceleration = {0.0, -9.0, -3.0};
  next.angular_velocity.setZero();
  Eigen::Vector3d turned = Eigen::Vector3d::Zero();
  const auto samples = bridge.until(next);
  ASSERT_EQ(samples.size(), 124u);
  for (const ImuMeasurement& sample : samples) turned += 0.02 * sample.angular_velocity;
  // The half step next to each end belongs to the trapezia of the ends.
  EXPECT_NEAR(turned.z(), 2.0 * tau * std::tanh(2.5 / (2.0 * tau)) - 0.02, 0.002)
      << "2 rad/s for one correlation time, not for 2.5 s";
  const Eigen::Vector3d expected = so3::exp({0.0, 0.0, -2.0 * tau}) * gravity;
  EXPECT_LT((samples.back().acceleration - expected).norm(), 0.3) << samples.back().acceleration.transpose();
  EXPECT_LT((samples[60].acceleration - expected).norm(), 0.1 * 4.0 + 0.1 * gravity.norm())
      << "hardly any acceleration besides";
  EXPECT_GT((samples[0].acceleration - gravity).x(), 3.5);
}

TEST(GapBridge, AGapOfAnHourGivesFiniteSamples) {
  GapBridge bridge;
  ImuMeasurement imu;
  imu.time = Time::fromNanoseconds(1);
  imu.acceleration = {0.0, 0.0, 9.8};
  imu.angular_velocity = {0.0, 0.0, 2.0};
  bridge.follow(imu);
  ImuMeasurement next = imu;
  next.time = imu.time + 3600.0;
  const auto samples = bridge.until(next);
  ASSERT_FALSE(samples.empty());
  for (const ImuMeasurement& sample : samples) {
    ASSERT_TRUE(sample.angular_velocity.allFinite());
    ASSERT_TRUE(sample.acceleration.allFinite());
  }
  EXPECT_NEAR(samples.back().angular_velocity.z(), 2.0, 0.1) << "as the end of the gap has it";
}

}  // namespace
}  // namespace rio_t
