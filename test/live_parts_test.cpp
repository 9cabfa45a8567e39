// Small parts of the live node: observability of the offset, rates of publication, and a bounded path.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <stdexcept>

#include "rio_t/evaluation/trajectory.h"
#include "rio_t/odometry/scan_result.h"
#include "rio_t/ros/live/bounded_trajectory.h"
#include "rio_t/ros/live/offset_observability.h"
#include "rio_t/ros/live/publish_rate.h"

namespace rio_t {
namespace {

/// Ten scans a second, radar velocities with 0.05 m/s per axis, of a platform that accelerates.
bool observableAt(double acceleration, double yaw_rate, bool used = true, int rest_scans = 0) {
  OffsetObservability observability;
  for (int k = 0; k < 20 + rest_scans; ++k) {
    const double t = 0.1 * k;
    const double moved = 0.1 * std::min(k, 20);
    ScanResult result;
    result.updated = true;
    result.used = used;
    result.state.time = Time::fromSeconds(t);
    result.state.q_WI = Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rate * moved, Eigen::Vector3d::UnitZ()));
    result.state.v_W = Eigen::Vector3d(1.0 + acceleration * moved, 0.0, 0.0);
    result.ego_velocity.covariance = 0.0025 * Eigen::Matrix3d::Identity();
    observability.add(result);
  }
  return observability.observable();
}

TEST(OffsetObservability, AccelerationShowsTheOffset) {
  // 0.05 m/s over sqrt(10) scans against |a| * 0.02 s: enough from 0.79 m/s^2 on.
  EXPECT_TRUE(observableAt(1.0, 0.0));
  EXPECT_FALSE(observableAt(0.6, 0.0));
}

TEST(OffsetObservability, ConstantVelocityShowsNothing) { EXPECT_FALSE(observableAt(0.0, 0.0)); }

TEST(OffsetObservability, TurningAtSpeedShowsTheOffset) { EXPECT_TRUE(observableAt(0.0, 1.0)); }

TEST(OffsetObservability, RejectedScansShowNothing) { EXPECT_FALSE(observableAt(2.0, 0.0, false)); }

TEST(OffsetObservability, IsOfTheLastSecondOnly) {
  EXPECT_TRUE(observableAt(2.0, 0.0, true, 5));
  EXPECT_FALSE(observableAt(2.0, 0.0, true, 15));
}

TEST(PublishRate, TakesTheFirstOfEachPeriodWhateverTheStart) {
  PublishRate rate(10.0);
  int published = 0;
  for (int k = 0; k < 409; ++k) published += rate.isDue(Time::fromSeconds(1.7e9 + k / 409.0)) ? 1 : 0;
  EXPECT_EQ(published, 10);
  PublishRate late(10.0);
  EXPECT_TRUE(late.isDue(Time::fromSeconds(1.7e9 + 0.05)));
  EXPECT_FALSE(late.isDue(Time::fromSeconds(1.7e9 + 0.09)));
  EXPECT_TRUE(late.isDue(Time::fromSeconds(1.7e9 + 0.11)));
  EXPECT_TRUE(late.isDue(Time::fromSeconds(1.0))) << "the clock jumped back";
}

TEST(PublishRate, OfZeroTakesAll) {
  PublishRate rate(0.0);
  for (int k = 0; k < 3; ++k) EXPECT_TRUE(rate.isDue(Time::fromSeconds(5.0)));
  rate.set(1.0);
  EXPECT_TRUE(rate.isDue(Time::fromSeconds(5.0)));
  EXPECT_FALSE(rate.isDue(Time::fromSeconds(5.5)));
}

TEST(BoundedTrajectory, KeepsEveryPoseUpToItsCapacity) {
  BoundedTrajectory bounded(5);
  EXPECT_TRUE(bounded.poses().empty());
  for (int k = 0; k < 5; ++k) bounded.add({Time::fromSeconds(k), Eigen::Vector3d(k, 0.0, 0.0), {}});
  ASSERT_EQ(bounded.poses().size(), 5U);
  EXPECT_EQ(bounded.poses()[3].p_W.x(), 3.0);
  EXPECT_EQ(bounded.stride(), 1U);
}

TEST(BoundedTrajectory, ThinsOutEvenlyAndReachesFromTheFirstPoseToTheLast) {
  for (const std::size_t capacity : {2U, 3U, 8U, 9U}) {
    BoundedTrajectory bounded(capacity);
    for (int k = 0; k < 200; ++k) {
      bounded.add({Time::fromSeconds(k), Eigen::Vector3d::Zero(), {}});
      const Trajectory poses = bounded.poses();
      EXPECT_LE(poses.size(), capacity + 1);
      EXPECT_EQ(poses.front().time, Time::fromSeconds(0.0));
      EXPECT_EQ(poses.back().time, Time::fromSeconds(k));
      for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
        EXPECT_EQ(poses[i].time, Time::fromSeconds(static_cast<double>(i * bounded.stride())));
      }
    }
    EXPECT_GT(bounded.poses().size(), capacity / 2);
  }
}

TEST(BoundedTrajectory, RefusesACapacityThatCannotHoldBothEnds) {
  EXPECT_THROW(BoundedTrajectory(1), std::invalid_argument);
}

}  // namespace
}  // namespace rio_t
