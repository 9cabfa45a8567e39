// What IMU samples are let through, and how much they are believed.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "noise.h"
#include "rio_t/imu/input_check.h"
#include "rio_t/imu/preintegration.h"
#include "rio_t/imu/stuck_axis_detector.h"
#include "synthetic_motion.h"

namespace rio_t {
namespace {

using Faults = std::vector<const char*>;

std::string names(const Faults& faults) {
  std::string all;
  for (const char* fault : faults) all += (all.empty() ? "" : " ") + std::string(fault);
  return all;
}

/// A gate that has seen a second of a motion at 100 Hz.
class Gate : public ::testing::Test {
 protected:
  Gate() : gate(0.04, ImuInputCheckOptions()) {
    for (; t < 1.0; t += 0.01) EXPECT_EQ(feed(t), "");
  }
  /// The faults that are told.
  std::string feed(double seconds) { return feed(motion.imuSample(seconds)); }
  std::string feed(const ImuMeasurement& imu) {
    sample = imu;
    const ImuInputCheck::Verdict verdict = gate.check(sample);
    is_taken = verdict.sample.fault == nullptr;
    is_restart = verdict.sample.is_restart;
    bridge = verdict.bridge;
    return names(verdict.faults);
  }
  SyntheticMotion motion;
  ImuInputCheck gate;
  double t = 0.0;
  ImuMeasurement sample;
  std::vector<ImuMeasurement> bridge;
  bool is_taken = false, is_restart = false;
};

TEST_F(Gate, GoodSamplesPassUnchanged) {
  EXPECT_EQ(feed(1.0), "");
  EXPECT_TRUE(is_taken);
  EXPECT_EQ(sample.unseen_gyro_variance, 0.0);
  EXPECT_EQ(sample.unseen_accel_variance, 0.0);
}

TEST_F(Gate, SamplesOutOfPlaceAreDroppedAndTheOthersGoOn) {
  EXPECT_EQ(feed(0.5), "imu_out_of_order");
  EXPECT_FALSE(is_taken);
  EXPECT_EQ(feed(0.99), "imu_out_of_order") << "a stamp twice";
  EXPECT_EQ(feed(1000.0), "imu_stamp_jump");
  EXPECT_FALSE(is_taken);
  EXPECT_EQ(feed(-1000.0), "imu_out_of_order");
  ImuMeasurement bad = motion.imuSample(1.0);
  bad.angular_velocity.y() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(feed(bad), "imu_not_finite");
  EXPECT_FALSE(is_taken);
  bad = motion.imuSample(1.0);
  bad.acceleration.x() = -1e4;
  EXPECT_EQ(feed(bad), "imu_not_plausible");
  EXPECT_FALSE(is_taken);
  bad = motion.imuSample(1.0);
  bad.angular_velocity.z() = -400.0;
  EXPECT_EQ(feed(bad), "imu_not_plausible");
  EXPECT_FALSE(is_taken);
  EXPECT_EQ(feed(1.0), "");
  EXPECT_TRUE(is_taken);
}

TEST_F(Gate, RangesThatAreToldBoundTheReadings) {
  ImuInputCheckOptions options;
  options.accel_range = 40.0;
  options.gyro_range = 3.0;
  gate = ImuInputCheck(0.04, options);
  const auto fed = [&](double acceleration, double rate) {
    ImuMeasurement imu = motion.imuSample(t);
    t += 0.01;
    imu.acceleration.x() = acceleration;
    imu.angular_velocity.x() = rate;
    return feed(imu);
  };
  EXPECT_EQ(fed(39.0, 2.9), "");
  EXPECT_EQ(fed(39.0, 3.1), "imu_saturated");
  EXPECT_EQ(fed(39.0, 2.9), "");
  EXPECT_EQ(fed(70.0, 2.9), "imu_saturated") << "the range may be rounded";
  EXPECT_TRUE(is_taken);
  EXPECT_EQ(fed(90.0, 2.9), "imu_not_plausible");
  EXPECT_FALSE(is_taken);
  EXPECT_EQ(fed(39.0, 6.1), "imu_not_plausible");
  EXPECT_FALSE(is_taken);
}

/// A driver that could not read its sensor publishes the last sample again.
TEST_F(Gate, ASampleThatRepeatsIsDropped) {
  ImuMeasurement last = motion.imuSample(1.0);
  last.angular_velocity.z() = 0.5;
  EXPECT_EQ(feed(last), "");
  for (double s = 1.01; s < 1.295; s += 0.01) {
    last.time = motion.time(s);
    ASSERT_EQ(feed(last), "imu_repeated") << s;
    ASSERT_FALSE(is_taken);
  }
  EXPECT_EQ(feed(1.3), "imu_gap");
  EXPECT_GT(bridge.size(), 10u);
  EXPECT_GT(sample.unseen_gyro_variance, 0.0);
}

TEST_F(Gate, ASampleThatRepeatsForLongIsHardlyBelieved) {
  ImuMeasurement last = motion.imuSample(1.0);
  last.angular_velocity.z() = 0.5;
  EXPECT_EQ(feed(last), "");
  for (double s = 1.01; s < 1.995; s += 0.01) {
    last.time = motion.time(s);
    ASSERT_NE(feed(last).find("imu_repeated"), std::string::npos) << s;
    ASSERT_EQ(is_taken, s >= 1.495) << s;
  }
  EXPECT_GT(sample.unseen_gyro_variance, 0.1);
  EXPECT_GT(sample.unseen_accel_variance, 1.0);
  EXPECT_EQ(feed(2.0), "");
  EXPECT_GT(sample.unseen_gyro_variance, 0.1) << "in the interval before";
  EXPECT_EQ(feed(2.01), "");
  EXPECT_EQ(sample.unseen_gyro_variance, 0.0);
}

/// Simulators have such IMUs.
TEST_F(Gate, AnImuWithoutNoiseMayRepeatItselfAtRest) {
  for (double s = 1.0; s < 2.0; s += 0.01) {
    ASSERT_EQ(feed({motion.time(s), {0.02, 0.0, 0.0}, {0.0, 0.0, 9.81}}), "") << s;
    ASSERT_TRUE(is_taken);
  }
  EXPECT_EQ(sample.unseen_gyro_variance, 0.0);
}

TEST_F(Gate, StampsThatRunElsewhereMakeAJumpOnlyAfterAWhile) {
  for (const double jump : {500.0, -700.0, 300.0}) {
    t += jump;
    const double begin = t;
    for (; t < begin + 0.495; t += 0.01) {
      feed(t);
      ASSERT_FALSE(is_taken) << t;
    }
    EXPECT_EQ(feed(t), "imu_clock_restart");
    EXPECT_TRUE(is_restart);
    EXPECT_EQ(sample.unseen_gyro_variance, 0.0);
    EXPECT_EQ(feed(t + 0.01), "");
    EXPECT_TRUE(is_taken);
    t += 0.02;
  }
}

TEST_F(Gate, AShortGlitchOfTheStampsIsAGap) {
  for (double glitch = 0.0; glitch < 0.3; glitch += 0.01) EXPECT_EQ(feed(101.0 + glitch), "imu_stamp_jump");
  EXPECT_EQ(feed(1.3), "imu_gap");
  EXPECT_TRUE(is_taken);
  EXPECT_GT(sample.unseen_gyro_variance, 0.0);
}

/// Stamps of a clock that steps back by `step` [s]: the samples until it has caught up are dropped.
class ClockStepsBack : public Gate, public ::testing::WithParamInterface<double> {};

TEST_P(ClockStepsBack, WhatTheMotionDidMeanwhileIsUnseen) {
  const double step = GetParam(), from = t;
  const ImuMeasurement before = motion.imuSample(from - 0.01);
  std::string told;
  for (; told.empty() || told == "imu_out_of_order"; t += 0.01) {
    ImuMeasurement imu = motion.imuSample(t);
    imu.time = imu.time + -step;
    told = feed(imu);
    ASSERT_LT(t, from + step + 0.02);
  }
  EXPECT_EQ(told, "imu_clock_back");
  EXPECT_TRUE(is_taken);
  EXPECT_NEAR(sample.lost_time, step, 0.011);
  const double dt = sample.time - before.time;
  const double turned = motion.q_WI(from - 0.01).angularDistance(motion.q_WI(t - 0.01));
  const double sigma = std::sqrt(sample.unseen_gyro_variance * dt);
  EXPECT_LT(turned, 1.5 * sigma);
  EXPECT_GT(turned, 0.3 * sigma);
  EXPECT_EQ(feed(motion.imuSample(t - step)), "");
  EXPECT_EQ(sample.lost_time, 0.0);
}

INSTANTIATE_TEST_SUITE_P(By, ClockStepsBack, ::testing::Values(0.02, 0.05, 0.2, 0.45), [](const auto& step) {
  return std::to_string(std::lround(1e3 * step.param)) + "ms";
});

TEST_F(Gate, MessagesThatWereOvertakenAreNoClockThatStepsBack) {
  for (const int overtaken : {1, 2, 8}) {
    const double first = t;
    for (int i = 0; i < overtaken; ++i) feed(first + 0.01 * (overtaken + i));
    for (int i = 0; i < overtaken; ++i) EXPECT_EQ(feed(first + 0.01 * i), "imu_out_of_order");
    t = first + 0.02 * overtaken;
    EXPECT_EQ(feed(t), "") << overtaken;
    EXPECT_EQ(sample.lost_time, 0.0);
    t += 0.01;
  }
}

// A sample ahead that ended a gap would put all samples that follow behind it, until the clock seems to jump.
TEST_F(Gate, OneStampAheadIsNoGap) {
  for (const double ahead : {0.6, 1.0, 2.5}) {
    EXPECT_EQ(feed(t + ahead), "imu_stamp_jump") << ahead;
    for (const double end = t + 3.0; t < end; t += 0.01) ASSERT_EQ(feed(t), "") << ahead;
  }
}

/// Within the patience such a stamp is taken. Those that follow are behind it until its time comes.
TEST_F(Gate, OneStampAheadIsNoStepBack) {
  EXPECT_EQ(feed(t + 0.3), "imu_gap");
  for (const double end = t + 0.295; t < end; t += 0.01) feed(t);
  for (t += 0.01; t < 2.0; t += 0.01) EXPECT_EQ(feed(t), "") << t;
}

TEST_F(Gate, TheSecondSampleConfirmsALongGap) {
  EXPECT_EQ(feed(2.0), "imu_stamp_jump");
  EXPECT_FALSE(is_taken);
  EXPECT_EQ(feed(2.01), "imu_gap");
  EXPECT_TRUE(is_taken);
  EXPECT_EQ(feed(2.02), "");
}

// The patience may be shorter or longer than the longest bridged gap.
TEST_F(Gate, NoGapIsBridgedThatIsLongerThanTheLongest) {
  for (const double patience : {0.1, 5.0}) {
    ImuInputCheckOptions options;
    options.max_bridged_gap = 0.3;
    options.jump_patience = patience;
    gate = ImuInputCheck(0.04, options);
    EXPECT_EQ(feed(1.0), "");
    EXPECT_EQ(feed(1.4), "imu_stamp_jump") << patience;
    std::string faults;
    for (double ahead = 1.41; faults.empty() && ahead < 8.0; ahead += 0.01) {
      faults = feed(ahead);
      if (faults == "imu_stamp_jump") faults.clear();
    }
    EXPECT_EQ(faults, "imu_clock_restart") << patience;
  }
}

TEST_F(Gate, UnseenMotionGrowsWithTheGap) {
  EXPECT_EQ(feed(1.05), "imu_gap");
  const double small = sample.unseen_accel_variance;
  EXPECT_GT(small, 0.0);
  EXPECT_EQ(feed(1.99), "imu_stamp_jump");  // it may stand alone
  EXPECT_EQ(feed(2.0), "imu_gap");
  EXPECT_NEAR(sample.unseen_accel_variance,
              ImuInputCheckOptions().unseen_accel_density * ImuInputCheckOptions().unseen_accel_density,
              1e-12);
  EXPECT_LT(small, 0.1 * sample.unseen_accel_variance);
}

TEST_F(Gate, OverAShortGapTheBridgeIsAlmostStraight) {
  EXPECT_EQ(feed(1.02), "");
  EXPECT_TRUE(bridge.empty());
  const ImuMeasurement before = sample;
  EXPECT_EQ(feed(1.12), "imu_gap");
  ASSERT_EQ(bridge.size(), 4u) << "one each 0.02 s";
  for (std::size_t i = 0; i < bridge.size(); ++i) {
    const double share = 0.2 * static_cast<double>(i + 1);
    EXPECT_NEAR(bridge[i].time - before.time, 0.1 * share, 1e-9);
    EXPECT_TRUE(bridge[i].is_bridge);
    EXPECT_EQ(bridge[i].unseen_gyro_variance, sample.unseen_gyro_variance);
    const Eigen::Vector3d turn = sample.angular_velocity - before.angular_velocity;
    // 1 - 1 / cosh(T / (2 tau)), in the middle
    EXPECT_LT((bridge[i].angular_velocity - before.angular_velocity - share * turn).norm(),
              0.005 * std::max(before.angular_velocity.norm(), sample.angular_velocity.norm()));
  }
  EXPECT_FALSE(sample.is_bridge);
}

TEST(Preintegration, UnseenMotionInAnIntervalWidensWhatCrossesIt) {
  const SyntheticMotion motion;
  const auto covariance = [&](double unseen_gyro_variance, double unseen_accel_variance,
                              double unseen_velocity_variance) {
    ImuBuffer buffer;
    for (int i = 0; i <= 20; ++i) {
      ImuMeasurement imu = motion.imuSample(0.01 * i);
      if (i == 10) {
        imu.unseen_gyro_variance = unseen_gyro_variance;
        imu.unseen_accel_variance = unseen_accel_variance;
        imu.unseen_velocity_variance = unseen_velocity_variance;
      }
      buffer.add(imu);
    }
    // The middle of the doubtful interval, which ends at 0.1 s, is an end here.
    return preintegrate(buffer, motion.time(0.0), motion.time(0.095), motion.b_g, motion.b_a, ImuNoise())
        .covariance;
  };
  const auto usual = covariance(0.0, 0.0, 0.0);
  const auto doubtful = covariance(0.04, 9.0, 0.0);
  const auto displaced = covariance(0.0, 0.0, 16.0);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(doubtful(k, k) - usual(k, k), 0.04 * 0.005, 1e-9);
    EXPECT_GT(doubtful(6 + k, 6 + k) - usual(6 + k, 6 + k), 9.0 * 0.005 - 1e-9);
    EXPECT_NEAR(displaced(3 + k, 3 + k) - usual(3 + k, 3 + k), 16.0 * 0.005, 1e-9);
    EXPECT_EQ(displaced(6 + k, 6 + k), usual(6 + k, 6 + k));
  }
}

TEST_F(Gate, AStuckGyroAxisIsReplaced) {
  ImuMeasurement stuck;
  for (double s = 1.0; s < 1.3; s += 0.01) {
    stuck = motion.imuSample(s);
    stuck.angular_velocity.y() = 17.4;
    EXPECT_NE(feed(stuck).find("imu_stuck"), std::string::npos) << s;
    EXPECT_LT(sample.angular_velocity.y(), 2.0);
    EXPECT_EQ(sample.angular_velocity.x(), stuck.angular_velocity.x());
    EXPECT_GT(sample.unseen_gyro_variance, 0.1);
  }
  feed(1.3);
  EXPECT_EQ(sample.angular_velocity, motion.imuSample(1.3).angular_velocity);
}

/// The readings of an axis at its end, through the calibration of a driver and with the noise of the others.
TEST_F(Gate, AStuckAxisMayHaveNoise) {
  Noise noise;
  for (double s = 1.0; s < 1.3; s += 0.01) {
    ImuMeasurement stuck = motion.imuSample(s);
    stuck.angular_velocity.y() = 17.4 + 0.01 * noise.vector().x();
    EXPECT_NE(feed(stuck).find("imu_stuck"), std::string::npos) << s;
    EXPECT_LT(sample.angular_velocity.y(), 2.0);
  }
  feed(1.3);
  EXPECT_EQ(sample.angular_velocity, motion.imuSample(1.3).angular_velocity);
}

/// From 1.0 to 1.3 s the IMU turns about x, and an axis stays at a plausible reading.
class AFrozenAxis : public Gate {
 protected:
  /// `freeze` sets the axis of a sample. `check` gets whether the repeats are to be found by then.
  void feedFrozen(const std::function<void(ImuMeasurement&)>& freeze,
                  const std::function<void(bool)>& check) {
    for (double s = 1.0; s < 1.3; s += 0.01) {
      ImuMeasurement frozen = motion.imuSample(s);
      frozen.angular_velocity.x() += 0.5;
      freeze(frozen);
      const bool is_found = s > 1.105;  // more than ten repeats
      ASSERT_EQ(feed(frozen), is_found ? "imu_stuck" : "") << s;
      check(is_found);
    }
    EXPECT_EQ(feed(1.3), "");
  }
};

TEST_F(AFrozenAxis, OfTheGyroIsReplaced) {
  feedFrozen([](ImuMeasurement& imu) { imu.angular_velocity.y() = 0.02; },
             [&](bool is_found) {
               EXPECT_EQ(sample.angular_velocity.y() < 0.02, is_found);
               EXPECT_EQ(sample.unseen_gyro_variance > 0.1, is_found);
             });
  EXPECT_EQ(sample.angular_velocity, motion.imuSample(1.3).angular_velocity);
}

TEST_F(AFrozenAxis, OfTheAccelerometerIsHardlyBelieved) {
  feedFrozen([](ImuMeasurement& imu) { imu.acceleration.y() = 0.1; },
             [&](bool is_found) {
               EXPECT_EQ(sample.unseen_accel_variance > 1.0, is_found);
               EXPECT_LT(sample.unseen_gyro_variance, 0.1);
             });
}

/// Simulators have such axes.
TEST(StuckAxisDetector, AnAxisWithoutNoiseMayNeverMove) {
  StuckAxisDetector axis;
  for (int i = 0; i < 1000; ++i) ASSERT_FALSE(axis.check(Time::fromSeconds(0.01 * i), 0.0, true, false)) << i;
}

/// An axis about which a vehicle hardly turns, with steps coarser than its noise. The rest before the start
/// shows its runs.
TEST(StuckAxisDetector, ACoarseGyroRepeatsItself) {
  StuckAxisDetector axis;
  for (int i = 0; i < 1000; ++i) {
    const double reading = i / 20 % 2 == 0 ? 0.0 : 0.001;
    ASSERT_FALSE(axis.check(Time::fromSeconds(0.01 * i), reading, i >= 100, false)) << i;
  }
}

TEST_F(Gate, AFastTurnThatGoesOnIsNotStuck) {
  // From nothing to 6 rad/s in one sample, as where samples are missing; and then it goes on to change.
  EXPECT_EQ(feed({motion.time(1.0), {6.0, 0.0, 0.0}, {0.0, 0.0, 9.81}}), "imu_stuck");
  EXPECT_EQ(feed({motion.time(1.01), {6.5, 0.0, 0.0}, {0.0, 0.0, 9.81}}), "");
  EXPECT_EQ(sample.angular_velocity.x(), 6.5);
}

TEST_F(Gate, AFastTurnAfterAGapIsNotStuck) {
  EXPECT_EQ(feed({motion.time(1.3), {4.0, 0.0, 0.0}, {0.0, 0.0, 9.81}}), "imu_gap");
  EXPECT_EQ(sample.angular_velocity.x(), 4.0);
  EXPECT_EQ(feed({motion.time(1.31), {4.1, 0.0, 0.0}, {0.0, 0.0, 9.81}}), "");
}

TEST_F(Gate, AnAxisThatSticksInAGapIsReplacedOnceItRepeats) {
  EXPECT_EQ(feed({motion.time(1.3), {17.4, 0.0, 0.0}, {0.0, 0.0, 9.81}}), "imu_gap");
  EXPECT_EQ(feed({motion.time(1.31), {17.4, 0.01, 0.0}, {0.0, 0.0, 9.81}}), "imu_stuck");
  EXPECT_LT(sample.angular_velocity.x(), 2.0);
}

/// The spacing of the samples over a gap would multiply what they show.
TEST_F(Gate, AGapAddsNoNoise) {
  Noise noise;
  const auto feedNoise = [&](double seconds) {
    feed({motion.time(seconds), 0.01 * noise.vector(),
          Eigen::Vector3d(0.0, 0.0, 9.81) + 0.1 * noise.vector()});
  };
  for (; t < 4.0; t += 0.01) feedNoise(t);
  const double before = std::sqrt(sample.accel_noise);
  for (t += 2.5; t < 8.0; t += 0.01) {
    feedNoise(t);
    EXPECT_LT(std::sqrt(sample.accel_noise), 1.3 * before) << t;
  }
}

/// Over the samples that see it, the variance is the square of the velocity that the wrong sample adds.
TEST_F(Gate, AWrongSampleIsInTheSigma) {
  Noise noise;
  double unseen_accel = 0.0, unseen_gyro = 0.0;
  for (int i = 0; i < 300; ++i) {
    ImuMeasurement imu = motion.imuSample(1.0 + 0.01 * i);
    imu.acceleration += 0.1 * noise.vector();
    imu.angular_velocity += 0.01 * noise.vector();
    if (i == 100) unseen_accel = unseen_gyro = 0.0;  // the noise was new
    if (i == 200) {
      EXPECT_EQ(unseen_accel, 0.0);
      imu.acceleration.x() += 50.0;
      imu.angular_velocity.z() += 1.0;
    }
    feed(imu);
    unseen_accel += 0.01 * sample.unseen_accel_variance;
    unseen_gyro += 0.01 * sample.unseen_gyro_variance;
  }
  EXPECT_NEAR(std::sqrt(unseen_accel), 50.0 * 0.01, 0.05);
  EXPECT_NEAR(std::sqrt(unseen_gyro), 1.0 * 0.01, 0.001);
}

TEST_F(Gate, AClockThatJumpsIsNoNoise) {
  for (const double jump : {-800.0, -100.0, 1000.0}) {
    gate = ImuInputCheck(0.04, ImuInputCheckOptions());
    for (t = 0.0; t < 1.0; t += 0.01) feed(t);
    const double before = sample.accel_noise;
    const auto later = [&](double seconds) {
      ImuMeasurement imu = motion.imuSample(seconds);
      imu.time = imu.time + jump;
      return imu;
    };
    bool restarted = false;
    for (; t < 4.0; t += 0.01) {
      feed(later(t));
      restarted = restarted || is_restart;
      if (!is_taken) continue;
      EXPECT_LT(std::sqrt(sample.accel_noise), 2.0 * std::sqrt(before) + 1e-3) << jump << " at " << t;
    }
    EXPECT_TRUE(restarted) << jump;
    EXPECT_TRUE(std::isfinite(sample.accel_noise)) << jump;
  }
}

TEST_F(Gate, NoiseFarAboveWhatWasToldIsSeen) {
  EXPECT_FALSE(gate.noise().isFarAbove(ImuNoise()));
  Noise noise;
  for (int i = 0; i < 300; ++i) {
    ImuMeasurement shaken = motion.imuSample(1.0 + 0.01 * i);
    shaken.acceleration += 0.8 * noise.vector();
    feed(shaken);
  }
  EXPECT_TRUE(gate.noise().isFarAbove(ImuNoise()));
  EXPECT_NEAR(gate.noise().accel_density, 0.08, 0.02);
  EXPECT_NEAR(sample.accel_noise, std::pow(gate.noise().accel_density, 2), 1e-12);
}

TEST(ImuSampleCheck, SaysWhetherTheStampsWentOnOverAGap) {
  SyntheticMotion motion;
  for (const bool is_jump : {false, true}) {
    ImuSampleCheck samples{ImuInputCheckOptions()};
    ImuSampleCheck::Verdict restart;
    for (int k = 0; k < 800; ++k) {
      const double t = 0.01 * k;
      ImuMeasurement imu = motion.imuSample(t);
      if (1.0 < t && t < 4.2) imu.acceleration.x() = std::nan("");
      if (is_jump && t > 1.0) imu.time = imu.time + 10.0;
      const ImuSampleCheck::Verdict verdict = samples.check(imu);
      if (verdict.is_restart) restart = verdict;
    }
    ASSERT_TRUE(restart.is_restart);
    EXPECT_EQ(restart.stamps_went_on, !is_jump);
    EXPECT_NEAR(static_cast<double>(restart.dropped["imu_not_finite"]), 319.0, 1.0);
    EXPECT_NEAR(static_cast<double>(restart.dropped["imu_stamp_jump"]), 50.0, 1.0);
  }
}

}  // namespace
}  // namespace rio_t
