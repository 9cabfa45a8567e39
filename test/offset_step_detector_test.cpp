#include "rio_t/sensors/offset_step_detector.h"

#include <gtest/gtest.h>

#include <cmath>

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
    if (detector.stepped({Time::fromSeconds(0.1 * i), d, S, S, J, J}, Eigen::Matrix3d::Identity()))
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

// Four seconds of scans from before it would outweigh the first second.
TEST(OffsetStepDetector, SeesALargeStepSoon) {
  EXPECT_LT(secondsToStep(0.1, 2.0, 0.03, 30.0), 31.5);
  EXPECT_LT(secondsToStep(-0.1, 2.0, 0.03, 30.0), 31.5);
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
    if (detector.stepped({Time::fromSeconds(t), d, S, S, J, J}, scan.R_WR())) found = t;
    detector.follow(J, scan);
    followed += due / 3.0;
  }
  EXPECT_GE(found, begin);
  EXPECT_LT(found, begin + 10.0);
}

// A large step makes outliers of the scans, and the window follows them less than the detector assumes.
TEST(OffsetStepDetector, SeesAStepThatTheVelocityDoesNotFollow) {
  OffsetStepDetector detector(OffsetStepDetectorOptions(), 0.25);
  const Eigen::Matrix3d S = 0.02 * 0.02 * Eigen::Matrix3d::Identity();
  OffsetScan scan;
  scan.predicted = scan.measured = 0.5 * S;
  double found = 60.0;
  for (int i = 0; i < 600 && found == 60.0; ++i) {
    const double t = 0.1 * i;
    const Eigen::Vector3d J = 2.0 * Eigen::Vector3d(std::sin(0.6 * t), std::cos(0.6 * t), 0.3);
    const Eigen::Vector3d e(std::sin(2.1 * i * i), std::cos(1.3 * i * i), std::sin(0.7 * i * i + 1.0));
    const Eigen::Vector3d d = (t < 30.0 ? 0.0 : 0.1) * J + 0.01 * e;
    if (detector.stepped({Time::fromSeconds(t), d, S, S, J, J}, scan.R_WR())) found = t;
    detector.follow(J, scan);
  }
  EXPECT_GE(found, 30.0);
  EXPECT_LT(found, 32.0);
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
                                  Eigen::Matrix3d::Identity()));
  }
}

}  // namespace
}  // namespace rio_t
