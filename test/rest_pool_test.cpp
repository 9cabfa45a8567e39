// The scans since the IMU came to rest.
#include "rio_t/sensors/rest_pool.h"

#include <gtest/gtest.h>

namespace rio_t {
namespace {

/// Its points carry its time as their Doppler.
RadarScan scanAt(double t, std::size_t points) {
  RadarScan scan;
  scan.stamp = Time::fromSeconds(t);
  scan.points.assign(points, {Eigen::Vector3d(0.0, 5.0, 0.0), t, 15.0});
  return scan;
}

TEST(RestPool, ThePointsOfTheNewestScanComeFirst) {
  RestPool pool;
  for (const double t : {1.0, 1.1, 1.2}) pool.add(scanAt(t, 4));
  const RadarScan newest = pool.newest(8);
  EXPECT_EQ(newest.stamp, Time::fromSeconds(1.2));
  ASSERT_EQ(newest.points.size(), 8U);
  EXPECT_EQ(newest.points.front().doppler, 1.2);
  EXPECT_EQ(newest.points.back().doppler, 1.1);
  EXPECT_EQ(pool.newest(9).points.size(), 12U);  // whole scans
  EXPECT_EQ(pool.newest(1000).points.size(), 12U);
}

TEST(RestPool, KeepsNoMoreThanItLends) {
  RestPool pool;
  for (int i = 0; i < 1000; ++i) pool.add(scanAt(0.1 * i, 40));
  EXPECT_EQ(pool.newest(1000000).points.size(), RestPool::kMost / 40 * 40 + 40);
}

TEST(RestPool, ALateScanStartsAnew) {
  RestPool pool;
  pool.add(scanAt(1.0, 3));
  pool.add(scanAt(0.9, 4));
  EXPECT_EQ(pool.newest(100).points.size(), 4U);
}

}  // namespace
}  // namespace rio_t
