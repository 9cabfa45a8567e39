// The scans since the IMU came to rest.
#include <gtest/gtest.h>

#include "rio_t/sensors/scan_pool.h"

namespace rio_t {
namespace {

/// Its points carry its time as their Doppler.
RadarScan scanAt(double t, std::size_t points) {
  RadarScan scan;
  scan.stamp = Time::fromSeconds(t);
  scan.points.assign(points, {Eigen::Vector3d(0.0, 5.0, 0.0), t, 15.0});
  return scan;
}

TEST(RestPool, ThePointsOfTheScanComeFirst) {
  RestPool pool;
  for (const double t : {1.0, 1.1}) pool.add(scanAt(t, 4));
  const RadarScan filled = pool.filled(scanAt(1.2, 5), 8);
  EXPECT_EQ(filled.stamp, Time::fromSeconds(1.2));
  ASSERT_EQ(filled.points.size(), 9U);  // whole scans
  EXPECT_EQ(filled.points.front().doppler, 1.2);
  EXPECT_EQ(filled.points.back().doppler, 1.1);
  EXPECT_EQ(pool.filled(scanAt(1.2, 5), 5).points.size(), 5U);
  EXPECT_EQ(pool.filled(scanAt(1.2, 5), 1000).points.size(), 13U);
}

TEST(RestPool, KeepsNoMoreThanItLends) {
  RestPool pool;
  for (int i = 0; i < 1000; ++i) pool.add(scanAt(0.1 * i, 40));
  const std::size_t kept = pool.filled(RadarScan(), 1000000).points.size();
  EXPECT_GE(kept, 500u);
  EXPECT_LT(kept, 540u) << "whole scans";
}

TEST(RestPool, ALateScanStartsAnew) {
  RestPool pool;
  pool.add(scanAt(1.0, 3));
  pool.add(scanAt(0.9, 4));
  EXPECT_EQ(pool.filled(RadarScan(), 100).points.size(), 4U);
}

}  // namespace
}  // namespace rio_t
