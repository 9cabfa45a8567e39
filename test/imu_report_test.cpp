// What check_bag finds in the samples of an IMU.
#include "rio_t/inspection/imu_report.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace rio_t {
namespace {

/// An IMU that stays where it is and turns about its x axis, which is level [rad/s].
std::vector<ImuMeasurement> rolling(double rate_hz, double omega) {
  std::vector<ImuMeasurement> imu;
  for (int i = 0; i < static_cast<int>(30.0 * rate_hz); ++i) {
    const double angle = omega * i / rate_hz;
    imu.push_back({Time::fromSeconds(1000.0 + i / rate_hz),
                   {omega, 0.0, 0.0},
                   {0.0, 9.81 * std::sin(angle), 9.81 * std::cos(angle)}});
  }
  return imu;
}

/// At 25 Hz three means are 0.72 s apart. Taken for 0.6 s, a turn of 196 degrees came out as 164, and that is
/// a turn of 196 degrees the other way round.
TEST(ImuReport, ATurnCountsOverTheTimeThatItsMeansAreApart) {
  for (const double rate_hz : {25.0, 200.0}) {
    const double omega = 12.0 / 11.0 * M_PI / 0.72;
    const ImuReport right = inspectImu(rolling(rate_hz, omega));
    EXPECT_EQ(right.rate_fault, "") << rate_hz;
    EXPECT_EQ(right.units.rate, RateUnit::kRadiansPerSecond) << rate_hz;

    std::vector<ImuMeasurement> inverted = rolling(rate_hz, omega);
    for (ImuMeasurement& sample : inverted) sample.angular_velocity *= -1.0;
    EXPECT_NE(inspectImu(inverted).rate_fault, "") << rate_hz;
  }
}

}  // namespace
}  // namespace rio_t
