// check_bag on bags with other units, signs, axes or fields: each is named, and dealt with.
#include <gtest/gtest.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/PointCloud2.h>

#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

#include "plain_bag.h"
#include "rio_t/imu/units.h"
#include "rio_t/ros/bag/check_bag.h"

namespace rio_t {
namespace {

using CheckBag = PlainBag;

float* fieldOf(sensor_msgs::PointCloud2& cloud, std::size_t point, const std::string& name) {
  for (const sensor_msgs::PointField& field : cloud.fields) {
    if (field.name == name)
      return reinterpret_cast<float*>(&cloud.data[point * cloud.point_step + field.offset]);
  }
  throw std::runtime_error("no field " + name);
}

TEST_F(CheckBag, AnImuInGIsNamed) {
  const BagCheck odd = check(rewritten("g", {[](sensor_msgs::Imu& imu) {
                                         imu.linear_acceleration.x /= 9.80665;
                                         imu.linear_acceleration.y /= 9.80665;
                                         imu.linear_acceleration.z /= 9.80665;
                                         return true;
                                       }}));
  expectLine(odd, FindingLevel::kOdd, {"the acceleration is in g"});
  EXPECT_EQ(configOf(odd).imu_units.acceleration, AccelerationUnit::kStandardGravity);
  expectRuns(odd);
  EXPECT_LT(turnFromTruth(odd), 5.0);
}

TEST_F(CheckBag, AnImuInDegreesIsNamed) {
  const BagCheck odd = check(rewritten("degrees", {[](sensor_msgs::Imu& imu) {
                                         imu.angular_velocity.x /= kDegree;
                                         imu.angular_velocity.y /= kDegree;
                                         imu.angular_velocity.z /= kDegree;
                                         return true;
                                       }}));
  expectLine(odd, FindingLevel::kOdd, {"the angular velocity is in deg/s"});
  EXPECT_EQ(configOf(odd).imu_units.rate, RateUnit::kDegreesPerSecond);
  expectRuns(odd);
}

TEST_F(CheckBag, AFieldWhoseNameIsYamlIsRead) {
  Changes changes;
  changes.cloud = [](sensor_msgs::PointCloud2& cloud) {
    for (sensor_msgs::PointField& field : cloud.fields) {
      if (field.name == "v_doppler_mps") field.name = "[velocity]";
    }
    return true;
  };
  const BagCheck odd = check(rewritten("yaml_field", changes), false);
  ASSERT_TRUE(odd.ready()) << describeCheck(odd);
  EXPECT_EQ(configOf(odd).radar_overrides.doppler, "[velocity]") << odd.yaml;
}

TEST_F(CheckBag, ANegativeDopplerIsNamed) {
  Changes changes;
  changes.cloud = [](sensor_msgs::PointCloud2& cloud) {
    for (std::size_t i = 0; i < cloud.width; ++i) *fieldOf(cloud, i, "v_doppler_mps") *= -1.0F;
    return true;
  };
  const BagCheck odd = check(rewritten("approaching", changes));
  expectLine(odd, FindingLevel::kOdd, {"Doppler", "positive for approaching targets"});
  EXPECT_EQ(configOf(odd).radar_overrides.doppler_sign, -1);
  expectRuns(odd);
  EXPECT_LT(turnFromTruth(odd), 5.0);
}

TEST_F(CheckBag, SwappedAxesAreNamed) {
  for (const auto& [a, b] : {std::make_pair("x", "y"), std::make_pair("y", "z")}) {
    Changes changes;
    changes.cloud = [a = std::string(a), b = std::string(b)](sensor_msgs::PointCloud2& cloud) {
      for (std::size_t i = 0; i < cloud.width; ++i) std::swap(*fieldOf(cloud, i, a), *fieldOf(cloud, i, b));
      return true;
    };
    const BagCheck odd = check(rewritten(std::string("swapped_") + a + b, changes));
    expectLine(odd, FindingLevel::kOdd, {"swapped"});
    expectRuns(odd);
    EXPECT_LT(turnFromTruth(odd), 5.0) << a << b;
  }
}

TEST_F(CheckBag, AnInvertedAxisIsNamed) {
  Changes changes;
  changes.cloud = [](sensor_msgs::PointCloud2& cloud) {
    for (std::size_t i = 0; i < cloud.width; ++i) *fieldOf(cloud, i, "x") *= -1.0F;
    return true;
  };
  const BagCheck odd = check(rewritten("inverted", changes));
  expectLine(odd, FindingLevel::kOdd, {"left-handed"});
  expectRuns(odd);
}

TEST_F(CheckBag, AxesOfAnotherConventionAreNamed) {
  Changes changes;
  changes.cloud = [](sensor_msgs::PointCloud2& cloud) {
    for (std::size_t i = 0; i < cloud.width; ++i) {
      float* x = fieldOf(cloud, i, "x");
      float* y = fieldOf(cloud, i, "y");
      const float right = *x;
      *x = *y;  // x forward, y left, z up
      *y = -right;
    }
    return true;
  };
  const BagCheck odd = check(rewritten("flu", changes));
  expectLine(odd, FindingLevel::kOdd, {"its axes are flu"});
  expectRuns(odd);
  EXPECT_LT(turnFromTruth(odd), 5.0);
}

TEST_F(CheckBag, FieldsThatNoPresetHasAreGuessed) {
  Changes changes;
  changes.cloud = [](sensor_msgs::PointCloud2& cloud) {
    for (sensor_msgs::PointField& field : cloud.fields) {
      if (field.name == "v_doppler_mps") field.name = "RangeRate";
      if (field.name == "snr_db") field.name = "SNR";
    }
    return true;
  };
  const BagCheck odd = check(rewritten("guessed", changes));
  expectLine(odd, FindingLevel::kOdd, {"no preset has the fields", "RangeRate"});
  expectRuns(odd);
}

TEST_F(CheckBag, PositionsInMillimetresAreOdd) {
  Changes changes;
  changes.cloud = [](sensor_msgs::PointCloud2& cloud) {
    for (std::size_t i = 0; i < cloud.width; ++i)
      for (const char* axis : {"x", "y", "z"}) *fieldOf(cloud, i, axis) *= 1000.0F;
    return true;
  };
  expectLine(check(rewritten("millimetres", changes), false), FindingLevel::kOdd,
             {"points", "are the positions in m?"});
}

TEST_F(CheckBag, AnotherUnitOfThePowerIsNamed) {
  Changes changes;
  changes.cloud = [](sensor_msgs::PointCloud2& cloud) {
    for (std::size_t i = 0; i < cloud.width; ++i) *fieldOf(cloud, i, "snr_db") *= 10.0F;
    return true;
  };
  const BagCheck odd = check(rewritten("power", changes));
  expectLine(odd, FindingLevel::kOdd, {"format", "snr_decidb"});
  EXPECT_EQ(configOf(odd).radar_overrides.power_unit, PowerUnit::kSnrDeciDb);
  expectRuns(odd);
}

}  // namespace
}  // namespace rio_t
