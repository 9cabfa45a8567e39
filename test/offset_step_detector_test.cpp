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
    if (detector.stepped({Time::fromSeconds(0.1 * i), d, S, S, J})) return 0.1 * i;
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
    EXPECT_FALSE(detector.stepped({Time::fromSeconds(0.1 * i), {1, 0, 0}, S, S, {2, 0, 0}}));
  }
}

}  // namespace
}  // namespace rio_t
