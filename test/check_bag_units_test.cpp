// check_bag on bags with other units, signs, axes or fields: each is named, and dealt with.
#include <gtest/gtest.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/PointCloud2.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "plain_bag.h"
#include "rio_t/core/angle.h"
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

TEST_F(CheckBag, ADopplerThatIsNotInMetresPerSecondIsNamed) {
  expectLine(check(bag_), FindingLevel::kOk, {"v_doppler_mps is positive for receding"});
  EXPECT_EQ(describeCheck(check(bag_, false)).find("times the Doppler"), std::string::npos);
  for (const auto& [factor, ratio] : {std::pair(0.5F, "at 2"), {2.0F, "at 0."}, {3.6F, "at 0.3"}}) {
    Changes changes;
    changes.cloud = [factor = factor](sensor_msgs::PointCloud2& cloud) {
      for (std::size_t i = 0; i < cloud.width; ++i) *fieldOf(cloud, i, "v_doppler_mps") *= factor;
      return true;
    };
    const BagCheck odd = check(rewritten("scaled", changes), false);
    expectLine(odd, FindingLevel::kOdd, {"ranges change", ratio, "is v_doppler_mps in m/s?"});
  }
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
  expectLine(odd, FindingLevel::kOdd, {"axes", "left-handed", "Or the accelerometer is negated"});
  expectRuns(odd);
}

/// The same data but for the direction of gravity: only a person can tell them apart.
TEST_F(CheckBag, ANegatedAccelerometerMayLookLikeAnInvertedAxis) {
  const BagCheck odd = check(rewritten("negated", {[](sensor_msgs::Imu& imu) {
                                         imu.linear_acceleration.x *= -1.0;
                                         imu.linear_acceleration.y *= -1.0;
                                         imu.linear_acceleration.z *= -1.0;
                                         return true;
                                       }}));
  const std::string how_to_tell =
      "at rest, ROS expects +9.81 m/s^2 along the direction that points up, and this IMU shows it along -z. "
      "If -z points down, the accelerometer is negated";
  expectLine(odd, FindingLevel::kOdd,
             {"axes", "the axes of the cloud are left-handed", "Or the accelerometer is negated",
              "mirror image", how_to_tell});
  expectLine(odd, FindingLevel::kOdd,
             {"IMU axes", "gravity is on -z", "Either z of the IMU is not up",
              "Or the accelerometer is negated", "mirror image", how_to_tell});
  expectLine(odd, FindingLevel::kOdd, {"trial run", "If the accelerometer is negated", "mirror image"});
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

/// A cloud of float32 fields with other names and values.
void rebuild(sensor_msgs::PointCloud2& cloud, const std::vector<std::string>& names,
             const std::function<std::vector<double>(double right, double forward, double up, double doppler,
                                                     double snr)>& values) {
  const sensor_msgs::PointCloud2 old = cloud;
  cloud.fields.clear();
  for (const std::string& name : names) {
    sensor_msgs::PointField field;
    field.name = name;
    field.offset = static_cast<std::uint32_t>(4 * cloud.fields.size());
    field.datatype = sensor_msgs::PointField::FLOAT32;
    field.count = 1;
    cloud.fields.push_back(field);
  }
  cloud.point_step = static_cast<std::uint32_t>(4 * names.size());
  cloud.row_step = cloud.point_step * cloud.width;
  cloud.data.assign(std::size_t{cloud.row_step} * cloud.height, 0);
  sensor_msgs::PointCloud2 from = old;
  for (std::size_t i = 0; i < from.width; ++i) {
    const auto of = [&](const char* name) { return static_cast<double>(*fieldOf(from, i, name)); };
    const std::vector<double> point = values(of("x"), of("y"), of("z"), of("v_doppler_mps"), of("snr_db"));
    for (std::size_t k = 0; k < names.size(); ++k)
      *fieldOf(cloud, i, names[k]) = static_cast<float>(point[k]);
  }
}

/// `range`, `doppler`: names of these fields.
Changes polar(double unit, const std::string& range = "range", const std::string& doppler_name = "velocity") {
  Changes changes;
  changes.cloud = [=](sensor_msgs::PointCloud2& cloud) {
    rebuild(cloud, {doppler_name, "azimuth", "elevation", range, "rcs"},
            [unit](double right, double forward, double up, double doppler, double snr) {
              const double ground = std::hypot(right, forward);
              return std::vector<double>{doppler, std::atan2(-right, forward) / unit,
                                         std::atan2(up, ground) / unit, std::hypot(ground, up), snr};
            });
    return true;
  };
  return changes;
}

TEST_F(CheckBag, AnglesInDegreesAreNamed) {
  const BagCheck odd = check(rewritten("polar_degrees", polar(kDegree)), false);
  expectLine(
      odd, FindingLevel::kMissing,
      {"radar", "azimuth runs from -", "elevation runs from -", "looks like degrees; expected radians"});
  EXPECT_FALSE(odd.ready());
  EXPECT_NE(odd.to_do.find("radians"), std::string::npos) << odd.to_do;
  const BagCheck radians = check(rewritten("polar_radians", polar(1.0)));
  expectRuns(radians);
  EXPECT_LT(turnFromTruth(radians), 5.0);
}

TEST_F(CheckBag, ARangeRateIsNoRange) {
  for (const char* range : {"range", "range_m"}) {
    SCOPED_TRACE(range);
    const BagCheck good = check(rewritten("range_rate", polar(1.0, range, "range_rate")));
    expectRuns(good);
    EXPECT_EQ(configOf(good).radar_overrides.doppler, "range_rate") << good.yaml;
    EXPECT_LT(turnFromTruth(good), 5.0);
  }
}

TEST_F(CheckBag, FieldsOfAnyNameCanBeTold) {
  Changes changes;
  changes.cloud = [](sensor_msgs::PointCloud2& cloud) {
    rebuild(cloud, {"pos_a", "pos_b", "pos_c", "d", "quality"},
            [](double right, double forward, double up, double doppler, double snr) {
              return std::vector<double>{right, forward, up, doppler, 10.0 * snr};
            });
    return true;
  };
  const std::string bag = rewritten("own_names", changes);
  const BagCheck no_doppler = check(bag, false);
  expectLine(no_doppler, FindingLevel::kMissing, {"no field name looks like a Doppler", "quality"});
  EXPECT_NE(no_doppler.to_do.find("--set radar_field_doppler=FIELD"), std::string::npos) << no_doppler.to_do;
  const BagCheck no_position = check(bag, false, {"radar_field_doppler=d"});
  expectLine(no_position, FindingLevel::kMissing, {"it has no position", "pos_a"});
  EXPECT_NE(no_position.to_do.find("radar_field_x=FIELD"), std::string::npos) << no_position.to_do;
  const std::vector<std::string> told = {"radar_field_doppler=d", "radar_field_x=pos_a",
                                         "radar_field_y=pos_b", "radar_field_z=pos_c",
                                         "radar_field_power=quality"};
  const BagCheck good = check(bag, true, told);
  expectRuns(good);
  EXPECT_LT(turnFromTruth(good), 5.0);
  EXPECT_EQ(configOf(good).radar_overrides.power, "quality");
  EXPECT_EQ(configOf(good).radar_overrides.power_unit, PowerUnit::kSnrDeciDb) << good.yaml;
}

TEST_F(CheckBag, WhatIsToldStandsInTheConfiguration) {
  const BagCheck told = check(bag_, false,
                              {"extrinsics_rotation_xyzw=[0, 0, 0, 1]", "estimate_extrinsics=none",
                               "radar_power_unit=not_snr", "radar_min_range=0.7"});
  ASSERT_TRUE(told.ready()) << describeCheck(told);
  const Config config = configOf(told);
  EXPECT_LT(config.odometry.radar.T_IR.q_IR.angularDistance(Eigen::Quaterniond::Identity()), 1e-9)
      << told.yaml;
  EXPECT_EQ(config.estimate_extrinsics, EstimateExtrinsics::kNone);
  EXPECT_EQ(config.radar_overrides.power_unit, PowerUnit::kNotSnr);
  EXPECT_NE(told.yaml.find("radar_min_range: 0.7"), std::string::npos) << told.yaml;
}

TEST_F(CheckBag, WhatCannotBeToldIsRefused) {
  const auto faultOf = [](const std::string& assignment) -> std::string {
    CheckRequest request;
    request.bags = {bag_};
    request.set = {parseAssignment(assignment)};
    try {
      validate(request);
    } catch (const std::exception& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(faultOf("radar_topic=/scan").find("expected --radar-topic"), std::string::npos);
  EXPECT_NE(faultOf("left/radar_field_x=X").find("left/radar_field_x"), std::string::npos);
  EXPECT_NE(faultOf("radar_feild_x=X").find("radar_feild_x"), std::string::npos);
}

TEST_F(CheckBag, AnImuWhoseZIsNotUpIsNamed) {
  const BagCheck odd =
      check(rewritten("y_up", {[](sensor_msgs::Imu& imu) {
                        for (geometry_msgs::Vector3* v : {&imu.linear_acceleration, &imu.angular_velocity}) {
                          const double y = v->y;
                          v->y = v->z;
                          v->z = -y;
                        }
                        return true;
                      }}));
  expectLine(odd, FindingLevel::kOdd,
             {"IMU axes", "gravity is on +y", "base_link",
              "base_extrinsics_rotation_xyzw: [0.7071, 0.0000, 0.0000, "
              "0.7071]",
              "docs/frames.md"});
  expectRuns(odd);
  EXPECT_EQ(describeCheck(check(bag_, false)).find("IMU axes"), std::string::npos);
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
