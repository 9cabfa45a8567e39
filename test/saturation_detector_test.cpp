#include "rio_t/imu/saturation_detector.h"

#include <gtest/gtest.h>

#include "synthetic_motion.h"

namespace rio_t {
namespace {

// An accelerometer that ends at 1 m/s^2 beyond what it first read shows flat tops; the noise at rest does
// not.
TEST(Saturation, FlatTopsAreFoundWithoutKnowingTheRange) {
  SyntheticMotion motion;
  SaturationDetector detector(0.0, 0.0);
  const Eigen::Vector3d limit =
      motion.imuSample(0.0).acceleration.cwiseAbs() + Eigen::Vector3d::Constant(1.0);
  int beyond = 0, found = 0, false_alarms = 0;
  for (int i = 0; i < 2000; ++i) {
    ImuMeasurement imu = motion.imuSample(0.005 * i);
    const bool clipped = (imu.acceleration.cwiseAbs().array() >= limit.array()).any();
    imu.acceleration = imu.acceleration.cwiseMin(limit).cwiseMax(-limit);
    const bool saturated = detector.check(imu).accel;
    beyond += clipped ? 1 : 0;
    found += clipped && saturated ? 1 : 0;
    false_alarms += !clipped && saturated ? 1 : 0;
  }
  ASSERT_GT(beyond, 100);
  EXPECT_GT(found, beyond - 20) << "of " << beyond;
  EXPECT_EQ(false_alarms, 0);
}

TEST(Saturation, ARestingSensorWithCoarseStepsIsNotSaturated) {
  SaturationDetector detector(0.0, 0.0);
  ImuMeasurement imu;
  for (int i = 0; i < 1000; ++i) {
    imu.acceleration = {0.0, 0.01 * (i / 7 % 3), 9.81 + 0.01 * (i / 5 % 2)};
    imu.angular_velocity = {0.0, 7e-4 * (i / 4 % 3), 0.0};
    const auto saturated = detector.check(imu);
    ASSERT_FALSE(saturated.accel || saturated.gyro) << i;
  }
}

TEST(Saturation, ALargerReadingTakesTheLimitBack) {
  SaturationDetector detector(0.0, 0.0);
  ImuMeasurement imu;
  const auto gyro = [&](double rate) {
    imu.angular_velocity.x() = rate;
    return detector.check(imu).gyro;
  };
  EXPECT_FALSE(gyro(0.0));
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(gyro(1.0));
  EXPECT_TRUE(gyro(1.0));
  EXPECT_FALSE(gyro(0.5));
  EXPECT_TRUE(gyro(-1.0)) << "the limit is known now, for both signs";
  EXPECT_FALSE(gyro(1.5));
  EXPECT_FALSE(gyro(1.0));
}

TEST(Saturation, AToldRangeHolds) {
  SaturationDetector detector(20.0, 5.0);
  ImuMeasurement imu;
  EXPECT_FALSE(detector.check(imu).gyro);
  imu.angular_velocity.z() = -5.0;
  EXPECT_TRUE(detector.check(imu).gyro);
  EXPECT_FALSE(detector.check(imu).accel);
  imu.angular_velocity.z() = 0.0;
  imu.acceleration.x() = 19.99;
  EXPECT_TRUE(detector.check(imu).accel);
  imu.acceleration.x() = 19.0;
  for (int i = 0; i < 8; ++i) EXPECT_FALSE(detector.check(imu).accel) << "flat, but not at the range";
}

}  // namespace
}  // namespace rio_t
