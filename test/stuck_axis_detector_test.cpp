// An axis that sticks, at the rates of all IMUs. What the gate makes of it is in imu_input_check_test.cpp.
#include "rio_t/imu/stuck_axis_detector.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "low_passed_axis.h"

namespace rio_t {
namespace {

constexpr double kDegree = M_PI / 180.0;
constexpr double kRates[] = {100.0, 200.0, 400.0, 1000.0, 2000.0};

/// The platform turns about another axis all the time. About this one it swings, creeps, and swings again.
TEST(StuckAxisDetector, ReadingsThatRepeatForASlowSwingAreNotFrozen) {
  for (const double rate : kRates) {
    for (const double noise : {0.005, 0.01}) {
      for (const double pause : {1.0, 3.0, 10.0}) {
        LowPassedAxis gyro(rate, 2000.0 * kDegree, noise * kDegree, 1);
        StuckAxisDetector detector;
        int frozen = 0;
        for (int i = 0; i < 60.0 * rate; ++i) {
          const double reading = gyro.next(std::max(0.05, std::sin(M_PI * i / rate / pause)));
          frozen += detector.check(gyro.time(), reading, true, false) ? 1 : 0;
        }
        EXPECT_EQ(frozen, 0) << rate << " Hz, " << noise << ", " << pause << " s";
      }
    }
  }
}

TEST(StuckAxisDetector, AReadingThatStaysForATenthOfASecondIsFrozen) {
  for (const double rate : kRates) {
    LowPassedAxis gyro(rate, 2000.0 * kDegree, 0.005 * kDegree, 1);
    StuckAxisDetector detector;
    double reading = 0.0;
    for (int i = 0; i < 20.0 * rate; ++i) {
      const bool freezes = i >= 10.0 * rate && i < 10.3 * rate;
      const double now = gyro.next(1.0);
      if (!freezes) reading = now;
      const bool is_frozen = detector.check(gyro.time(), reading, true, false).has_value();
      const double since = i / rate - 10.0;
      if (!freezes || since > 0.12) {
        ASSERT_EQ(is_frozen, freezes) << rate << " Hz, " << since;
      }
    }
  }
}

/// Feeds an axis at one rate.
struct FedAxis {
  StuckAxisDetector detector;
  double rate = 100.0;
  int count = 0;
  bool check(double reading) {
    return detector.check(Time::fromSeconds(++count / rate), reading, true, false).has_value();
  }
  /// Readings that do not repeat and hardly jump, for some seconds.
  void vary(double seconds) {
    for (int i = 0; i < seconds * rate; ++i) ASSERT_FALSE(check(0.001 * (i % 2))) << rate << " Hz";
  }
  /// The same reading for some seconds. Returns whether the last one is taken as frozen.
  bool repeat(double reading, double seconds) {
    bool is_frozen = false;
    for (int i = 0; i < seconds * rate; ++i) is_frozen = check(reading);
    return is_frozen;
  }
};

TEST(StuckAxisDetector, TheLongestRunIsRememberedForSecondsAtAnyRate) {
  for (const double rate : kRates) {
    FedAxis axis{{}, rate};
    axis.repeat(0.5, 0.2);
    axis.vary(3.0);
    EXPECT_FALSE(axis.repeat(0.6, 0.4)) << rate << " Hz";
    axis.vary(30.0);
    EXPECT_TRUE(axis.repeat(0.6, 0.4)) << rate << " Hz";
  }
}

TEST(StuckAxisDetector, TheUsualJumpIsRememberedForSecondsAtAnyRate) {
  for (const double rate : kRates) {
    FedAxis axis{{}, rate};
    axis.vary(1.0);
    EXPECT_FALSE(axis.check(1.0));
    axis.vary(3.0);
    EXPECT_FALSE(axis.check(3.0)) << rate << " Hz";
    axis.vary(30.0);
    EXPECT_TRUE(axis.check(3.0)) << rate << " Hz";
  }
}

/// Readings that a bus spoils: each differs from the one before, and the true ones go on after them.
TEST(StuckAxisDetector, CorruptReadingsInARowAreReplacedAndTheTrueOnesAreNot) {
  const std::vector<std::vector<double>> bursts = {{17.0}, {17.0, -9.0}, {-500.0, 500.0}, {12.0, -16.0, 8.0}};
  for (const double rate : kRates) {
    for (const std::vector<double>& burst : bursts) {
      FedAxis axis{{}, rate};
      axis.vary(1.0);
      for (const double reading : burst) {
        EXPECT_TRUE(axis.check(reading)) << rate << " Hz, " << reading << " of " << burst.size();
      }
      axis.vary(1.0);
    }
  }
}

/// A wrong reading that is near the true one passes. A far one after it does not.
TEST(StuckAxisDetector, AWrongReadingThatPassesTellsNothingOfTheNext) {
  for (const double rate : kRates) {
    FedAxis axis{{}, rate};
    axis.vary(1.0);
    EXPECT_FALSE(axis.check(1.9)) << rate << " Hz";
    EXPECT_TRUE(axis.check(-3.0)) << rate << " Hz";
    axis.vary(1.0);
    EXPECT_TRUE(axis.check(6.0)) << rate << " Hz";
    EXPECT_FALSE(axis.check(-1.9)) << rate << " Hz";
    EXPECT_FALSE(axis.check(0.2)) << rate << " Hz";
    axis.vary(1.0);
  }
}

TEST(StuckAxisDetector, TheTrueReadingsAfterAWrongOneThatPassesDoNotStick) {
  for (const double rate : kRates) {
    FedAxis axis{{}, rate};
    axis.vary(1.0);
    EXPECT_FALSE(axis.check(1.9)) << rate << " Hz";
    EXPECT_FALSE(axis.check(-0.2)) << rate << " Hz, 2.1 rad/s from the wrong reading";
    EXPECT_FALSE(axis.check(-0.201)) << rate << " Hz";
  }
}

/// In 50 ms a platform comes to some of the corrupt readings. They do not agree with each other, as motion
/// does.
TEST(StuckAxisDetector, TheTrueReadingsAfterManyCorruptOnesAreNotReplaced) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> corrupt(-17.0, 17.0);
  for (const double rate : kRates) {
    for (int burst = 0; burst < 20; ++burst) {
      FedAxis axis{{}, rate};
      axis.vary(1.0);
      for (int i = 0; i < 0.05 * rate; ++i) axis.check(corrupt(random));
      int replaced = 0;
      for (int i = 0; i < rate; ++i) replaced += axis.check(0.001 * (i % 2)) ? 1 : 0;
      EXPECT_EQ(replaced, 0) << rate << " Hz, burst " << burst;
    }
  }
}

/// Over a gap a platform may change its rate, and it goes on to change it.
TEST(StuckAxisDetector, ATurnThatGrowsAfterAGapIsBelieved) {
  FedAxis axis;
  axis.vary(1.0);
  axis.count += 5;
  for (const double reading : {3.0, 4.0, 5.0, 5.5, 5.6, 5.5}) EXPECT_FALSE(axis.check(reading)) << reading;
}

}  // namespace
}  // namespace rio_t
