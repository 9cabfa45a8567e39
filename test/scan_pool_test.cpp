// Points that a scan borrows from those before it.
#include "rio_t/sensors/scan_pool.h"

#include <gtest/gtest.h>

#include <cmath>

namespace rio_t {
namespace {

/// Scans every 50 ms, of points in made-up directions.
RadarScan scanAt(double t, std::size_t points) {
  RadarScan scan;
  scan.stamp = Time::fromSeconds(t);
  for (std::size_t i = 0; i < points; ++i) {
    const double a = 1.7 * static_cast<double>(i) + 20.0 * t;
    scan.points.push_back(
        {{3.0 * std::sin(a), 4.0, std::cos(2.0 * a)}, 100.0 * t + static_cast<double>(i), 15.0});
  }
  return scan;
}

std::optional<Eigen::Vector3d> steady(Time) { return Eigen::Vector3d(0.0, 1.0, 0.0); }

/// [m/s], at `t` seconds.
Eigen::Vector3d velocity(double t) { return {0.3 * t, 1.0 + 2.0 * t * t, std::sin(t)}; }
std::optional<Eigen::Vector3d> accelerating(Time stamp) { return velocity(stamp - Time::fromSeconds(0.0)); }

/// Whether `scan` has, from `first` on, the points of `of`, with their Dopplers.
bool hasPointsOf(const RadarScan& scan, std::size_t first, const RadarScan& of) {
  if (scan.points.size() < first + of.points.size()) return false;
  for (std::size_t i = 0; i < of.points.size(); ++i) {
    if (scan.points[first + i].position_R != of.points[i].position_R) return false;
    if (std::abs(scan.points[first + i].doppler - of.points[i].doppler) > 1e-12) return false;
  }
  return true;
}

TEST(ScanPool, OwnPointsComeFirstThenThoseOfTheNewestScans) {
  ScanPool pool;
  EXPECT_EQ(pool.filled(scanAt(10.00, 6), steady).points.size(), 6U);
  EXPECT_EQ(pool.filled(scanAt(10.05, 5), steady).points.size(), 11U);
  const RadarScan filled = pool.filled(scanAt(10.10, 4), steady);
  EXPECT_EQ(filled.stamp, Time::fromSeconds(10.10));
  ASSERT_EQ(filled.points.size(), 15U);
  EXPECT_TRUE(hasPointsOf(filled, 0, scanAt(10.10, 4)));
  EXPECT_TRUE(hasPointsOf(filled, 4, scanAt(10.05, 5)));
  EXPECT_TRUE(hasPointsOf(filled, 9, scanAt(10.00, 6)));
}

TEST(ScanPool, ItFillsUpToTwentyPointsAndNoFurther) {
  ScanPool pool;
  for (const double t : {10.00, 10.05, 10.10}) pool.filled(scanAt(t, 8), steady);
  const RadarScan filled = pool.filled(scanAt(10.15, 8), steady);
  EXPECT_EQ(filled.points.size(), 24U);  // whole scans, until there are 20
  EXPECT_TRUE(hasPointsOf(filled, 16, scanAt(10.05, 8)));
  EXPECT_EQ(pool.filled(scanAt(10.20, 19), steady).points.size(), 27U);
  // A scan that has enough borrows nothing.
  const RadarScan own = pool.filled(scanAt(10.25, 20), steady);
  EXPECT_EQ(own.points.size(), 20U);
  EXPECT_TRUE(hasPointsOf(own, 0, scanAt(10.25, 20)));
}

TEST(ScanPool, BorrowedPointsAreNotLentAgain) {
  ScanPool pool;
  for (int i = 0; i < 3; ++i) pool.filled(scanAt(10.0 + 0.05 * i, 2), steady);
  EXPECT_EQ(pool.filled(scanAt(10.15, 2), steady).points.size(), 8U);
}

TEST(ScanPool, ABorrowedDopplerChangesAsTheVelocityDid) {
  // Exact Dopplers at each scan: those borrowed are exact at the new one.
  ScanPool pool;
  RadarScan filled;
  for (const double t : {1.00, 1.05, 1.10}) {
    RadarScan scan = scanAt(t, 5);
    for (RadarPoint& p : scan.points) p.doppler = -p.position_R.normalized().dot(velocity(t));
    filled = pool.filled(scan, accelerating);
  }
  ASSERT_EQ(filled.points.size(), 15U);
  for (const RadarPoint& p : filled.points)
    EXPECT_NEAR(p.doppler, -p.position_R.normalized().dot(velocity(1.10)), 1e-12);
}

TEST(ScanPool, OldScansAreLeftOut) {
  ScanPool pool;
  pool.filled(scanAt(10.00, 3), steady);
  pool.filled(scanAt(10.10, 4), steady);
  EXPECT_EQ(pool.filled(scanAt(10.00 + ScanPool::kMaxAge + 0.01, 5), steady).points.size(), 9U);
  EXPECT_EQ(pool.filled(scanAt(12.00, 5), steady).points.size(), 5U);
}

TEST(ScanPool, ALateScanStartsAnew) {
  ScanPool pool;
  pool.filled(scanAt(10.00, 3), steady);
  pool.filled(scanAt(10.10, 4), steady);
  EXPECT_EQ(pool.filled(scanAt(10.05, 5), steady).points.size(), 5U);
  EXPECT_EQ(pool.filled(scanAt(10.15, 2), steady).points.size(), 7U);
  // A bag that begins again.
  EXPECT_EQ(pool.filled(scanAt(1.0, 5), steady).points.size(), 5U);
  EXPECT_EQ(pool.filled(scanAt(1.1, 5), steady).points.size(), 10U);
}

TEST(ScanPool, WithoutAPredictionNothingIsBorrowed) {
  ScanPool pool;
  pool.filled(scanAt(10.00, 3), steady);
  pool.filled(scanAt(10.10, 3), steady);
  const auto unknown = [](Time) -> std::optional<Eigen::Vector3d> { return std::nullopt; };
  EXPECT_EQ(pool.filled(scanAt(10.15, 3), unknown).points.size(), 3U);
  // Known since the second scan only.
  const auto lately = [](Time stamp) -> std::optional<Eigen::Vector3d> {
    if (stamp < Time::fromSeconds(10.05)) return std::nullopt;
    return Eigen::Vector3d::Zero();
  };
  EXPECT_EQ(pool.filled(scanAt(10.18, 3), lately).points.size(), 9U);
}

}  // namespace
}  // namespace rio_t
