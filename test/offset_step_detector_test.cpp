#include "rio_t/sensors/offset_step_detector.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

namespace rio_t {
namespace {

/// Scans at 10 Hz whose acceleration turns about, with an offset error and made-up noise of 0.03 m/s.
/// Seconds until a step is seen; 60 where none is.
/// `quiet`: [s] during which the offset was right.
double secondsToStep(double offset_error, double acceleration, double noise = 0.03, double quiet = 0.0) {
  OffsetStepDetector detector(OffsetStepDetectorOptions(), 0.25);
  const Eigen::Matrix3d S = 0.05 * 0.05 * Eigen::Matrix3d::Identity();
  for (int i = 0; i < 600; ++i) {
    const Eigen::Vector3d J = acceleration * Eigen::Vector3d(std::sin(0.31 * i), std::cos(0.23 * i), 0.3);
    const Eigen::Vector3d e(std::sin(2.1 * i * i), std::cos(1.3 * i * i), std::sin(0.7 * i * i + 1.0));
    const double error = 0.1 * i < quiet ? 0.0 : offset_error;
    const Eigen::Vector3d d = error * J + std::sqrt(2.0) * noise * e;
    if (detector.stepped({Time::fromSeconds(0.1 * i), d, S, S, J, J}, Eigen::Matrix3d::Identity(), 0.0))
      return 0.1 * i;
  }
  return 60.0;
}

TEST(OffsetStepDetector, IsQuietWhereTheOffsetIsRight) {
  EXPECT_EQ(secondsToStep(0.0, 2.0), 60.0);
  EXPECT_EQ(secondsToStep(0.0, 0.0), 60.0) << "no excitation";
}

TEST(OffsetStepDetector, SeesAStepOfEitherSign) {
  EXPECT_LT(secondsToStep(0.05, 2.0), 5.0);
  EXPECT_LT(secondsToStep(-0.05, 2.0), 5.0);
  EXPECT_LT(secondsToStep(0.05, 0.7), 20.0);
}

TEST(OffsetStepDetector, SeesALargeStepSoon) {
  EXPECT_LT(secondsToStep(0.1, 2.0, 0.03, 30.0), 31.5);
  EXPECT_LT(secondsToStep(-0.1, 2.0, 0.03, 30.0), 31.5);
}

/// Scans at `rate` [Hz] of a platform that accelerates evenly; `error(t)` [s] is what their velocities show.
/// S says `sigma` [m/s].
template <class Error>
std::optional<OffsetStep> stepOf(double rate, const Error& error, double t_O = 0.0, double noise = 0.03,
                                 double sigma = 0.03) {
  OffsetStepDetector detector(OffsetStepDetectorOptions(), 0.25);
  const Eigen::Matrix3d S = sigma * sigma * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d J(1.5, -1.0, 0.5);
  for (int i = 0; i < 20.0 * rate; ++i) {
    const Eigen::Vector3d e(std::sin(2.1 * i * i), std::cos(1.3 * i * i), std::sin(0.7 * i * i + 1.0));
    const Time stamp = Time::fromSeconds(i / rate);
    const Eigen::Vector3d d = error(i / rate) * J + noise * e;
    if (const auto step = detector.stepped({stamp, d, S, S, J, J}, Eigen::Matrix3d::Identity(), t_O))
      return step;
  }
  return std::nullopt;
}

TEST(OffsetStepDetector, TellsWhenAndByHowMuch) {
  for (const double rate : {5.0, 10.0, 25.0, 50.0}) {
    const auto step = stepOf(rate, [](double t) { return t < 9.99 ? 0.0 : 0.1; });
    ASSERT_TRUE(step) << rate;
    EXPECT_NEAR(step->first.seconds(), 10.0, 1e-6) << rate;
    EXPECT_NEAR(step->change, 0.1, 0.02) << rate;
  }
}

// A person in front of the radar, whose velocity happens to lie along the derivative.
TEST(OffsetStepDetector, WhatPassesWithinASecondIsNoStep) {
  for (const double rate : {10.0, 25.0, 50.0})
    EXPECT_FALSE(stepOf(rate, [](double t) { return t > 9.99 && t < 10.9 ? 0.1 : 0.0; })) << rate;
}

// The scatter of the scans is a hundredth of S here, and any trend would be significant against it. Against a
// fifth of S, the 70 scans after the first second tell 8.5 ms.
TEST(OffsetStepDetector, ScansThatHardlyScatterAreNotBelievedAllTheSame) {
  EXPECT_FALSE(stepOf(
      10.0, [](double) { return 0.0075; }, 0.0, 0.005, 0.05));
  EXPECT_TRUE(stepOf(
      10.0, [](double) { return 0.0095; }, 0.0, 0.005, 0.05));
}

TEST(OffsetStepDetector, NoStepLeavesTheBounds) {
  const auto step = [](double t) { return t < 9.99 ? 0.0 : 0.1; };
  EXPECT_TRUE(stepOf(10.0, step, 0.1));
  EXPECT_TRUE(stepOf(10.0, step, -0.2));
  EXPECT_FALSE(stepOf(10.0, step, 0.2)) << "0.3 s is beyond 0.25 s";
}

// A platform that turns its acceleration in ten seconds. The estimated velocity follows each scan by a third
// of its innovation, so an innovation shows only what has changed within some scans.
TEST(OffsetStepDetector, SeesAStepThatTheVelocityFollows) {
  OffsetStepDetector detector(OffsetStepDetectorOptions(), 0.25);
  const Eigen::Matrix3d S = 0.02 * 0.02 * Eigen::Matrix3d::Identity();
  const double step = 0.06, begin = 30.0;
  OffsetScan scan;
  scan.predicted = S / 3.0;
  scan.measured = S - scan.predicted;
  Eigen::Vector3d followed = Eigen::Vector3d::Zero();  // by the velocity, because of the step
  double found = 60.0;
  for (int i = 0; i < 600 && found == 60.0; ++i) {
    const double t = 0.1 * i;
    const Eigen::Vector3d J = 2.0 * Eigen::Vector3d(std::sin(0.6 * t), std::cos(0.6 * t), 0.3);
    const Eigen::Vector3d e(std::sin(2.1 * i * i), std::cos(1.3 * i * i), std::sin(0.7 * i * i + 1.0));
    const Eigen::Vector3d due = (t < begin ? 0.0 : step) * J - followed;
    const Eigen::Vector3d d = due + 0.01 * e;
    if (detector.stepped({Time::fromSeconds(t), d, S, S, J, J}, scan.R_WR(), 0.0)) found = t;
    detector.follow(Time::fromSeconds(t), J, scan);
    followed += due / 3.0;
  }
  EXPECT_GE(found, begin);
  EXPECT_LT(found, begin + 10.0);
}

// The loss of the window makes outliers of the scans after a large step: it follows them half as much as the
// detector assumes.
TEST(OffsetStepDetector, SeesAStepThatTheVelocityFollowsLess) {
  OffsetStepDetector detector(OffsetStepDetectorOptions(), 0.25);
  const Eigen::Matrix3d S = 0.02 * 0.02 * Eigen::Matrix3d::Identity();
  OffsetScan scan;
  scan.predicted = scan.measured = 0.5 * S;
  Eigen::Vector3d followed = Eigen::Vector3d::Zero();
  double found = 60.0;
  for (int i = 0; i < 600 && found == 60.0; ++i) {
    const double t = 0.1 * i;
    const Eigen::Vector3d J = 2.0 * Eigen::Vector3d(std::sin(0.6 * t), std::cos(0.6 * t), 0.3);
    const Eigen::Vector3d e(std::sin(2.1 * i * i), std::cos(1.3 * i * i), std::sin(0.7 * i * i + 1.0));
    const Eigen::Vector3d due = (t < 30.0 ? 0.0 : 0.1) * J - followed;
    if (detector.stepped({Time::fromSeconds(t), due + 0.01 * e, S, S, J, J}, scan.R_WR(), 0.0)) found = t;
    detector.follow(Time::fromSeconds(t), J, scan);
    followed += 0.25 * due;
  }
  EXPECT_GE(found, 30.0);
  EXPECT_LT(found, 32.0);
}

// A driver may deliver a scan late. It says nothing about a step that came after it.
TEST(OffsetStepDetector, AScanFromBeforeAStepHasNotFollowedIt) {
  const auto changeOf = [](bool one_is_late) {
    OffsetStepDetector detector(OffsetStepDetectorOptions(), 0.25);
    const Eigen::Matrix3d S = 0.03 * 0.03 * Eigen::Matrix3d::Identity();
    const Eigen::Vector3d J(1.5, -1.0, 0.5);
    OffsetScan late;
    late.predicted = late.measured = 0.5 * S;
    std::optional<OffsetStep> step;
    for (int i = 0; i < 50 && !step; ++i) {
      step = detector.stepped({Time::fromSeconds(0.1 * i), 0.1 * J, S, S, J, J}, late.R_WR(), 0.0);
      if (one_is_late && i == 2) detector.follow(Time::fromSeconds(-1.0), J, late);
    }
    return step ? step->change : 0.0;
  };
  EXPECT_NEAR(changeOf(false), 0.1, 1e-9);
  EXPECT_NEAR(changeOf(true), 0.1, 1e-9);
}

// The window does not take a scan that the gate rejects, so nobody calls follow.
TEST(OffsetStepDetector, SeesAStepWhoseScansAreRejected) {
  EXPECT_LT(secondsToStep(0.2, 2.0, 0.01, 30.0), 31.5);
}

TEST(OffsetStepDetector, AChangeBeyondTheBoundsIsNoStep) { EXPECT_EQ(secondsToStep(0.8, 2.0), 60.0); }

TEST(OffsetStepDetector, LeavesSmallChangesToTheRandomWalk) {
  EXPECT_EQ(secondsToStep(0.003, 5.0, 0.005), 60.0);
}

TEST(OffsetStepDetector, DoesNotSpeakWithoutExcitation) { EXPECT_EQ(secondsToStep(0.05, 0.0), 60.0); }

TEST(OffsetStepDetector, CanBeTurnedOff) {
  OffsetStepDetectorOptions options;
  options.enabled = false;
  OffsetStepDetector detector(options, 0.25);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Matrix3d S = 1e-4 * Eigen::Matrix3d::Identity();
    EXPECT_FALSE(detector.stepped({Time::fromSeconds(0.1 * i), {1, 0, 0}, S, S, {2, 0, 0}, {2, 0, 0}},
                                  Eigen::Matrix3d::Identity(), 0.0));
  }
}

}  // namespace
}  // namespace rio_t
