#include "rio_t/imu/saturation_detector.h"

#include <gtest/gtest.h>

#include "low_passed_axis.h"
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
  imu.acceleration.z() = 9.81;
  detector.check(imu);
  // Steps so small that all others come to a flat top steeply.
  imu.acceleration.y() = 0.01;
  imu.angular_velocity.y() = 0.002;
  detector.check(imu);
  for (int i = 0; i < 1000; ++i) {
    imu.acceleration = {0.0, 0.22 * (i / 7 % 3), 9.81 + 0.01 * (i / 5 % 2)};
    imu.angular_velocity = {0.0, 0.045 * (i / 6 % 3), 0.0};
    const auto saturated = detector.check(imu);
    ASSERT_FALSE(saturated.accel || saturated.gyro) << i;
  }
  // Flat tops not far beyond are.
  imu.acceleration.y() = 0.6;
  imu.angular_velocity.y() = 0.12;
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(detector.check(imu).accel);
  const auto saturated = detector.check(imu);
  EXPECT_TRUE(saturated.accel);
  EXPECT_TRUE(saturated.gyro);
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

constexpr double kDegree = M_PI / 180.0;

/// A gyro of 2000 degrees/s and an accelerometer of 16 g. At the top of a swing, readings so close in time
/// are the same.
TEST(Saturation, TheTopOfASwingIsNoEndOfTheRangeAtAnyRate) {
  for (const double rate : {100.0, 200.0, 400.0, 1000.0, 2000.0}) {
    for (const double size : {1.0, 0.2}) {
      for (const double noise : {0.005, 0.01}) {
        LowPassedAxis gyro(rate, 2000.0 * kDegree, noise * kDegree, 1);
        LowPassedAxis accel(rate, 16.0 * 9.81, 0.03 * noise * 9.81, 2);
        SaturationDetector detector(0.0, 0.0);
        int flagged = 0;
        for (int i = 0; i < 60.0 * rate; ++i) {
          ImuMeasurement imu;
          imu.angular_velocity.x() = gyro.next(size);
          imu.acceleration.x() = accel.next(3.0 * size);
          imu.time = gyro.time();
          const auto saturated = detector.check(imu);
          flagged += saturated.accel || saturated.gyro ? 1 : 0;
        }
        EXPECT_EQ(flagged, 0) << rate << " Hz, " << size << ", " << noise;
      }
    }
  }
}

/// Swings of up to 1.6 ranges, of gyros of 250 and 2000 degrees/s. The first one may hardly touch the end.
TEST(Saturation, AFlatTopIsFoundAtAnyRate) {
  for (const double rate : {100.0, 200.0, 400.0, 1000.0, 2000.0}) {
    for (const double range : {250.0 * kDegree, 2000.0 * kDegree}) {
      LowPassedAxis gyro(rate, range, 0.005 * kDegree, 3);
      SaturationDetector detector(0.0, 0.0);
      int beyond = 0, found = 0, false_alarms = 0;
      for (int i = 0; i < 60.0 * rate; ++i) {
        ImuMeasurement imu;
        imu.angular_velocity.y() = gyro.next(0.6 * range);
        imu.time = gyro.time();
        const bool saturated = detector.check(imu).gyro;
        beyond += gyro.isAtEnd() ? 1 : 0;
        found += gyro.isAtEnd() && saturated ? 1 : 0;
        false_alarms += !gyro.isAtEnd() && saturated ? 1 : 0;
      }
      ASSERT_GT(beyond, rate) << range;
      EXPECT_GT(found, 0.95 * beyond) << "of " << beyond << " at " << rate << " Hz, " << range;
      EXPECT_EQ(false_alarms, 0) << rate << " Hz, " << range;
    }
  }
}

TEST(Saturation, TheEndOfTheRangeIsTheLargestReadingOfASecondAtAnyRate) {
  for (const double rate : {100.0, 2000.0}) {
    SaturationDetector detector(0.0, 0.0);
    ImuMeasurement imu;
    const auto hold = [&](double reading, double seconds) {
      bool saturated = false;
      for (int i = 0; i < seconds * rate; ++i) {
        imu.time = imu.time + 1.0 / rate;
        imu.angular_velocity.x() = reading + 0.001 * (i % 3);
        saturated |= detector.check(imu).gyro;
      }
      for (int i = 0; i < 6; ++i) saturated |= detector.check(imu).gyro;
      return saturated;
    };
    EXPECT_FALSE(hold(0.0, 1.0));
    imu.angular_velocity.x() = 5.0;
    EXPECT_FALSE(detector.check(imu).gyro);
    EXPECT_FALSE(hold(0.0, 0.5));
    imu.angular_velocity.x() = 3.0;
    for (int i = 0; i < 6; ++i) EXPECT_FALSE(detector.check(imu).gyro) << rate << " Hz";
    EXPECT_FALSE(hold(0.0, 2.0));
    imu.angular_velocity.x() = 3.0;
    for (int i = 0; i < 6; ++i) EXPECT_EQ(detector.check(imu).gyro, i >= 4) << rate << " Hz";
  }
}

}  // namespace
}  // namespace rio_t
