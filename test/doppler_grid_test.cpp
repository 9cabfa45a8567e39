#include "rio_t/radar/doppler_grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <vector>

#include "noise.h"
#include "rio_t/radar/doppler_span.h"

namespace rio_t {
namespace {

constexpr double kNoise = 0.035;  // [m/s] of a Doppler before it is rounded

/// As a driver gives a Doppler: rounded to the step, then to a float. A step of 0: none.
double asGiven(double doppler, double step) {
  return static_cast<float>(step > 0.0 ? step * std::round(doppler / step) : doppler);
}

/// Points anywhere ahead of a radar that moves forward at `speed` [m/s].
RadarScan scanAt(double speed, std::size_t points, double step, Random& random) {
  RadarScan scan;
  for (std::size_t i = 0; i < points; ++i) {
    RadarPoint p;
    p.doppler = asGiven(-std::cos(random.uniform(-1.2, 1.2)) * speed + kNoise * random.normal(), step);
    scan.points.push_back(p);
  }
  return scan;
}

/// Rest, then a walk.
double speedOf(int scan) { return scan < 50 ? 0.0 : 0.9 - 0.6 * std::cos(0.1 * (scan - 50)); }

void expectStep(const DopplerGrid& grid, double step) {
  EXPECT_EQ(grid.step().source, DopplerSource::kData);
  EXPECT_NEAR(grid.step().value, step, 1e-3 * step);
}

TEST(DopplerGrid, FindsTheStepOfAWalk) {
  for (const double step : {0.04, 0.0634, 0.125, 0.49}) {
    for (const std::size_t points : {std::size_t{5}, std::size_t{45}}) {
      for (std::uint32_t seed = 1; seed <= 20; ++seed) {
        SCOPED_TRACE(testing::Message() << step << " m/s, " << points << " points, seed " << seed);
        DopplerGrid grid(0.0);
        Random random(seed);
        for (int i = 0; i < 50; ++i) grid.add(scanAt(speedOf(i), points, step, random));
        EXPECT_TRUE(grid.step().source == DopplerSource::kUnknown ||
                    std::abs(grid.step().value - step) <
                        1e-3 * step);  // rest tells little, but nothing wrong
        // Two scans of 45 points, or 14 of 5, have a batch of values other than zero, and one may be begun.
        const int scans = points == 5 ? 20 : 3;
        for (int i = 50; i < 50 + scans; ++i) grid.add(scanAt(1.0, points, step, random));
        expectStep(grid, step);
        for (int i = 50; i < 1000; ++i) grid.add(scanAt(speedOf(i), points, step, random));
        expectStep(grid, step);
      }
    }
  }
}

TEST(DopplerGrid, DriversMayRoundToDecimals) {
  Random random(1);
  for (const double step : {0.0634, 0.4758}) {
    DopplerGrid grid(0.0);
    for (int i = 0; i < 300; ++i) {
      RadarScan scan = scanAt(i < 200 ? speedOf(i) : 8.0, 10, step * 1.00005, random);
      for (RadarPoint& p : scan.points) p.doppler = 1e-4 * std::round(1e4 * p.doppler);
      grid.add(scan);
    }
    expectStep(grid, step);
  }
}

// At rest all values are zero. When a platform with coarse steps sets off, one step is all there is to see.
TEST(DopplerGrid, IsTheLargestThatItCanBeUntilTheDataTell) {
  DopplerGrid grid(0.0);
  RadarScan scan;
  scan.points.resize(40);
  for (int i = 0; i < 1000; ++i) grid.add(scan);
  EXPECT_EQ(grid.step().source, DopplerSource::kUnknown);
  EXPECT_EQ(grid.step().value, DopplerGrid::kLargestUsualStep);
  // One value alone is a multiple, but nobody knows of how many steps.
  for (const double value : {0.491, 0.125, 0.98}) {
    DopplerGrid slow(0.0);
    for (std::size_t i = 0; i < 5; ++i) scan.points[i].doppler = i % 2 == 0 ? value : -value;
    for (int i = 0; i < 1000; ++i) slow.add(scan);
    EXPECT_EQ(slow.step().source, DopplerSource::kUnknown);
    EXPECT_EQ(slow.step().value, value);
  }
}

TEST(DopplerGrid, BecomesSmallerWhenOddMultiplesCome) {
  Random random(2);
  DopplerGrid grid(0.0);
  const auto add = [&](const std::vector<int>& multiples) {
    RadarScan scan;
    for (const int multiple : multiples) {
      RadarPoint p;
      p.doppler = asGiven(0.0634 * multiple, 0.0);
      scan.points.push_back(p);
    }
    for (int i = 0; i < 100; ++i) grid.add(scan);
  };
  add({0, 0, 2, -4, 6});
  expectStep(grid, 2 * 0.0634);
  add({0, 0, 2, -3, 6});  // and never a single one
  expectStep(grid, 0.0634);
  add({0, 0, 2, -4, 6});
  expectStep(grid, 0.0634);  // what was seen is not forgotten
}

TEST(DopplerGrid, NoneIsSaidSoon) {
  for (const double speed : {0.0, 0.3, 1.0, 10.0}) {
    for (const std::size_t points : {std::size_t{4}, std::size_t{45}}) {
      for (std::uint32_t seed = 1; seed <= 20; ++seed) {
        SCOPED_TRACE(testing::Message() << speed << " m/s, " << points << " points, seed " << seed);
        DopplerGrid grid(0.0);
        Random random(seed);
        const int scans = points == 4 ? 40 : 4;  // 160 values, of which one in five is zero at rest
        for (int i = 0; i < scans; ++i) grid.add(scanAt(speed, points, 0.0, random));
        for (int i = 0; i < 300; ++i) {
          ASSERT_EQ(grid.step().source, DopplerSource::kData) << i;
          ASSERT_EQ(grid.step().value, 0.0) << i;
          grid.add(scanAt(speed, points, 0.0, random));
        }
      }
    }
  }
}

// All points straight ahead: values without steps that lie as close together as they can.
TEST(DopplerGrid, AClusterIsNoStep) {
  for (const double noise : {0.003, 0.01, 0.03}) {
    for (std::uint32_t seed = 1; seed <= 20; ++seed) {
      DopplerGrid grid(0.0);
      Random random(seed);
      for (int i = 0; i < 1000; ++i) {
        RadarScan scan;
        scan.points.resize(5);
        for (RadarPoint& p : scan.points) p.doppler = asGiven(1.0 + noise * random.normal(), 0.0);
        grid.add(scan);
        ASSERT_FALSE(grid.step().source == DopplerSource::kData && grid.step().value > 0.0)
            << grid.step().value << " m/s at scan " << i << ", noise " << noise << ", seed " << seed;
      }
    }
  }
}

TEST(DopplerGrid, BearsMisfits) {
  // What else a driver may put in: values that are not rounded, marks for "none".
  const std::vector<std::function<double(Random&)>> misfits = {
      [](Random& random) { return random.uniform(-2.0, 2.0); },
      [](Random&) { return -999.9; },
      [](Random&) { return 1e10; },
      [](Random&) { return std::numeric_limits<double>::quiet_NaN(); },
      [](Random&) { return std::numeric_limits<double>::infinity(); },
  };
  for (const auto& misfit : misfits) {
    for (const double step : {0.0634, 0.125, 0.49}) {
      for (std::uint32_t seed = 1; seed <= 20; ++seed) {
        SCOPED_TRACE(testing::Message() << step << " m/s, seed " << seed);
        DopplerGrid grid(0.0);
        Random random(seed);
        for (int i = 0; i < 1000; ++i) {
          RadarScan scan = scanAt(speedOf(i), 20, step, random);
          for (RadarPoint& p : scan.points) {
            if (random.uniform(0, 1) < 0.02) p.doppler = misfit(random);
          }
          grid.add(scan);
          if (i < 100) continue;
          ASSERT_EQ(grid.step().source, DopplerSource::kData) << i;
          ASSERT_NEAR(grid.step().value, step, 2e-3 * step) << i;
        }
      }
    }
  }
}

TEST(DopplerGrid, ARadarThatIsSetUpAnewIsReadAnew) {
  Random random(3);
  DopplerGrid grid(0.0);
  for (const double step : {0.125, 0.09, 0.0, 0.49}) {
    for (int i = 0; i < 30; ++i) grid.add(scanAt(2.0, 20, step, random));
    expectStep(grid, step);
  }
}

TEST(DopplerGrid, TheGivenStepHolds) {
  Random random(4);
  DopplerGrid given(0.3);
  DopplerGrid none(1e-6);
  for (int i = 0; i < 200; ++i) {
    const RadarScan scan = scanAt(speedOf(i), 45, 0.125, random);
    given.add(scan);
    none.add(scan);
  }
  EXPECT_EQ(given.step().source, DopplerSource::kGiven);
  EXPECT_EQ(given.step().value, 0.3);
  EXPECT_EQ(none.step().source, DopplerSource::kGiven);
  EXPECT_EQ(none.step().value, 0.0);
  EXPECT_THROW(DopplerGrid{-0.1}, std::invalid_argument);
  EXPECT_THROW(DopplerGrid{std::numeric_limits<double>::quiet_NaN()}, std::invalid_argument);
  EXPECT_THROW(DopplerGrid{std::numeric_limits<double>::infinity()}, std::invalid_argument);
}

TEST(DopplerGrid, SameScansSameAnswer) {
  for (const double step : {0.0634, 0.0}) {
    DopplerGrid first(0.0), second(0.0);
    Random random(5), again(5);
    for (int i = 0; i < 200; ++i) {
      first.add(scanAt(speedOf(i), 7, step, random));
      second.add(scanAt(speedOf(i), 7, step, again));
      ASSERT_EQ(first.step().value, second.step().value);
      ASSERT_EQ(first.step().source, second.step().source);
    }
  }
}

constexpr double kStep = 0.125;
constexpr double kSpan = 3.0;

/// A scan of a walk before a radar of +-1.5 m/s.
std::vector<RadarDirection> scanOfWalk(const Eigen::Vector3d& v_R, Random& random) {
  std::vector<RadarDirection> points;
  for (int i = 0; i < 40; ++i) {
    const double azimuth = random.uniform(-1.2, 1.2);
    const Eigen::Vector3d u_R(std::sin(azimuth), std::cos(azimuth), 0.0);
    const double doppler = unwrapped(-u_R.dot(v_R), 0.0, kSpan);
    points.push_back({u_R, kStep * (std::floor(doppler / kStep) + 0.5)});
  }
  return points;
}

/// The velocity is `v_R`, and none fits the Dopplers as they read.
TwoReadings wrapping(const Eigen::Vector3d& v_R) { return {Eigen::Vector3d::Zero(), v_R}; }

/// A walk at up to 2.4 m/s. The first scan may have errors of the transmission.
DopplerSpan spanOfWalk(const std::vector<double>& errors = {}) {
  Random random(1);
  DopplerSpan span(0.0);
  std::vector<RadarDirection> first;
  for (const double doppler : errors) first.push_back({Eigen::Vector3d::UnitY(), doppler});
  span.learn(first, std::nullopt, kStep);
  for (int k = 0; k < 20; ++k) {
    const Eigen::Vector3d v_R(0.0, std::min(2.4, 0.5 + 0.2 * k), 0.0);
    span.learn(scanOfWalk(v_R, random), wrapping(v_R), kStep);
  }
  return span;
}

TEST(DopplerSpan, IsFoundInAWalk) {
  EXPECT_NEAR(spanOfWalk().value(), kSpan, 0.5 * kStep);
  EXPECT_EQ(spanOfWalk().known().source, DopplerSource::kData);
}

TEST(DopplerSpan, OneWildDopplerDoesNotEndIt) {
  DopplerSpan span = spanOfWalk();
  span.learn({{Eigen::Vector3d::UnitY(), 60.0}}, wrapping({0.0, 1.0, 0.0}), kStep);
  EXPECT_NEAR(span.value(), kSpan, 0.5 * kStep);
  span.learn(std::vector<RadarDirection>(20, {Eigen::Vector3d::UnitY(), 2.5}), wrapping({0.0, -2.5, 0.0}),
             kStep);
  EXPECT_EQ(span.value(), 0.0) << "many show that it was wrong";
}

TEST(DopplerSpan, WildDopplersBeforeItIsFoundDoNotHideIt) {
  EXPECT_NEAR(spanOfWalk({60.0}).value(), kSpan, 0.5 * kStep);
  EXPECT_NEAR(spanOfWalk({60.0, -327.68, 5.0, 7.0}).value(), kSpan, 0.5 * kStep);
}

TEST(DopplerSpan, ErrorsNowAndThenDoNotAddUp) {
  DopplerSpan span = spanOfWalk();
  for (int k = 0; k < 100; ++k)
    span.learn({{Eigen::Vector3d::UnitY(), k % 2 == 0 ? 60.0 : 1.0}}, wrapping({0.0, 1.0, 0.0}), kStep);
  EXPECT_NEAR(span.value(), kSpan, 0.5 * kStep);
}

/// The points of a scan share its velocity: however many, they are one witness.
TEST(DopplerSpan, IsNotShownByAFewScans) {
  Random random(2);
  DopplerSpan span(0.0);
  const Eigen::Vector3d v_R(0.0, 2.4, 0.0);
  for (int k = 0; k < 5; ++k) span.learn(scanOfWalk(v_R, random), wrapping(v_R), kStep);
  EXPECT_EQ(span.value(), 0.0);
  // A velocity that fits the wrapped Dopplers as they read.
  for (int k = 0; k < 50; ++k) span.learn(scanOfWalk(v_R, random), wrapping({0.0, -0.6, 0.0}), kStep);
  EXPECT_EQ(span.value(), 0.0);
  EXPECT_NEAR(span.possible(), kSpan, 0.5 * kStep);
}

/// A straight drive before a radar of few bins: the velocity forward fits the Dopplers as they read, and one
/// backward fits them if they may wrap around.
TEST(DopplerSpan, IsNotShownByDopplersThatFitAsTheyRead) {
  constexpr double kBin = 0.476;
  const auto ahead = [](double doppler) {
    return std::vector<RadarDirection>(10, {Eigen::Vector3d::UnitY(), doppler});
  };
  DopplerSpan span(0.0);
  span.learn(ahead(0.0), std::nullopt, kBin);
  span.learn(ahead(-3.0 * kBin), std::nullopt, kBin);
  const TwoReadings before{{0.0, 2.0 * kBin, 0.0}, {0.0, -2.0 * kBin, 0.0}};
  for (int k = 0; k < 50; ++k) span.learn(ahead(-2.0 * kBin), before, kBin);
  EXPECT_NEAR(span.possible(), 4.0 * kBin, 1e-9);
  EXPECT_EQ(span.value(), 0.0);
}

}  // namespace
}  // namespace rio_t
