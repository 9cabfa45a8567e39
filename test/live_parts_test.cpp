#include <gtest/gtest.h>

#include "rio_t/ros/offset_observability.h"
#include "rio_t/ros/scan_queue.h"

namespace rio_t {
namespace {

ScanQueue::Item scanAt(double seconds) {
  ScanQueue::Item item;
  item.scan.stamp = Time::fromSeconds(seconds);
  return item;
}

TEST(ScanQueue, GivesScansInOrderAndReportsTheOldestAsItGoes) {
  ScanQueue queue(2);
  EXPECT_FALSE(queue.pop());
  EXPECT_FALSE(queue.push(scanAt(1.0)));
  EXPECT_FALSE(queue.push(scanAt(2.0)));
  const std::optional<RadarScan> dropped = queue.push(scanAt(3.0));
  ASSERT_TRUE(dropped);
  EXPECT_EQ(dropped->stamp, Time::fromSeconds(1.0));
  EXPECT_EQ(queue.size(), 2U);
  EXPECT_EQ(queue.pop()->scan.stamp, Time::fromSeconds(2.0));
  EXPECT_EQ(queue.pop()->scan.stamp, Time::fromSeconds(3.0));
  EXPECT_FALSE(queue.pop());
}

TEST(ScanQueue, RefusesToHoldNothing) { EXPECT_THROW(ScanQueue(0), std::invalid_argument); }

/// Ten scans a second, radar velocities with 0.05 m/s per axis, of a platform that accelerates.
bool observableAt(double acceleration, double yaw_rate, bool used = true, int rest_scans = 0) {
  OffsetObservability observability(1.0, 0.02);
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

}  // namespace
}  // namespace rio_t
