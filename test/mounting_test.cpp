#include "rio_t/radar/mounting.h"

#include <gtest/gtest.h>

#include <cmath>

#include "rio_t/core/angle.h"
#include "rio_t/imu/units.h"
#include "rio_t/simulation/presets.h"

namespace rio_t {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

const Vector3d kRight = Vector3d::UnitX(), kForward = Vector3d::UnitY(), kUp = Vector3d::UnitZ();

Quaterniond rotation(double yaw, double pitch, double roll) {
  return rotationOf({yaw * kDegree, pitch * kDegree, roll * kDegree});
}

void expectNear(const Vector3d& a, const Vector3d& b) { EXPECT_LT((a - b).norm(), 1e-12) << a.transpose(); }

TEST(Mounting, ZeroLooksForwardAndStandsUpright) {
  const Quaterniond q = rotation(0, 0, 0);
  expectNear(q * kForward, Vector3d(1, 0, 0));
  expectNear(q * kRight, Vector3d(0, -1, 0));
  expectNear(q * kUp, Vector3d(0, 0, 1));
  // As the README has it.
  EXPECT_LT(q.angularDistance(Quaterniond(std::sqrt(0.5), 0, 0, -std::sqrt(0.5))), 1e-12);
}

TEST(Mounting, YawIsToTheLeftPitchIsUpRollIsRightSideDown) {
  expectNear(rotation(90, 0, 0) * kForward, Vector3d(0, 1, 0));
  expectNear(rotation(0, 90, 0) * kForward, Vector3d(0, 0, 1));
  expectNear(rotation(0, 0, 90) * kRight, Vector3d(0, 0, -1));
  expectNear(rotation(0, 0, 180) * kUp, Vector3d(0, 0, -1));
  // Yaw first, then pitch: a radar that looks left and 30 degrees up.
  expectNear(rotation(90, 30, 0) * kForward, Vector3d(0, std::cos(30 * kDegree), std::sin(30 * kDegree)));
}

TEST(Mounting, TheKartOfTheSimulatorInWords) {
  // data.md: yaw +30, up 22 degrees.
  EXPECT_LT(rotation(30, 22, 0).angularDistance(simulation::presetOf("kart").options.T_IR.q_IR), 1e-6);
  EXPECT_LT(rotation(30, 22, 0).angularDistance(Quaterniond(0.8501141, 0.1652454, -0.0954045, -0.4908136)),
            1e-6);
}

TEST(Mounting, AnglesComeBack) {
  for (double yaw = -170; yaw < 179; yaw += 25) {
    for (double pitch = -85; pitch <= 85; pitch += 17) {
      for (double roll = -175; roll < 179; roll += 35) {
        const MountingAngles back = mountingOf(rotation(yaw, pitch, roll));
        EXPECT_NEAR(back.yaw, yaw * kDegree, 1e-9);
        EXPECT_NEAR(back.pitch, pitch * kDegree, 1e-9);
        EXPECT_NEAR(back.roll, roll * kDegree, 1e-9);
      }
    }
  }
}

TEST(Mounting, StraightUpIsAnOrientationAllTheSame) {
  for (const double pitch : {-90.0, 90.0}) {
    const Quaterniond q = rotation(40, pitch, 20);
    EXPECT_LT(q.angularDistance(rotationOf(mountingOf(q))), 1e-6);
    EXPECT_EQ(mountingOf(q).roll, 0.0);
  }
}

TEST(ImuUnits, AreConverted) {
  ImuMeasurement imu;
  imu.acceleration = {0, 0, 1};
  imu.angular_velocity = {0, 180, 0};
  const ImuMeasurement same = converted(imu, {});
  EXPECT_EQ(same.acceleration, imu.acceleration);
  const ImuMeasurement si = converted(imu, {AccelerationUnit::kStandardGravity, RateUnit::kDegreesPerSecond});
  EXPECT_DOUBLE_EQ(si.acceleration.z(), 9.80665);
  EXPECT_DOUBLE_EQ(si.angular_velocity.y(), 3.14159265358979323846);
}

}  // namespace
}  // namespace rio_t
