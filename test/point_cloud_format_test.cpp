// The formats of point clouds: each preset, what can be overridden, and names.
#include "rio_t/ros/parameters/point_cloud_format.h"

#include <gtest/gtest.h>
#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/PointField.h>

#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "point_cloud_message.h"
#include "rio_t/ros/cloud/point_cloud.h"
#include "rio_t/ros/parameters/parameters.h"

namespace rio_t {
namespace {

using sensor_msgs::PointCloud2;
using sensor_msgs::PointField;

// --- The presets ---

TEST(PointCloudPreset, Irs) {
  const DecodedScan scan = decode(irsMessage(), pointCloudPreset("irs"));
  ASSERT_EQ(scan.cloud.size(), 2u);
  EXPECT_EQ(scan.dropped_not_finite, 0u);
  expectPoint(scan.cloud[0], 1, 2, 3, 0.5, 20);
  expectPoint(scan.cloud[1], -1, 4, 0.5, -0.25, 11);
}

TEST(PointCloudPreset, TiMmwave) {
  PointCloud2 m = Message(1, 32)
                      .floats("x", 0, {2})
                      .floats("y", 4, {-1})
                      .floats("z", 8, {3})
                      .floats("intensity", 16, {12.5F})
                      .floats("velocity", 20, {-0.75F})
                      .get();
  const DecodedScan scan = decode(m, pointCloudPreset("ti_mmwave"));
  ASSERT_EQ(scan.cloud.size(), 1u);
  expectPoint(scan.cloud[0], 1, 2, 3, -0.75, 12.5);
}

TEST(PointCloudPreset, Eth) {
  PointCloud2 m = Message(1, 20)
                      .floats("x", 0, {1})
                      .floats("y", 4, {2})
                      .floats("z", 8, {3})
                      .floats("doppler", 12, {0.5F})
                      .field<std::int16_t>("snr", 16, PointField::INT16, {155})
                      .field<std::int16_t>("noise", 18, PointField::INT16, {-400})
                      .get();
  const DecodedScan scan = decode(m, pointCloudPreset("eth"));
  ASSERT_EQ(scan.cloud.size(), 1u);
  expectPoint(scan.cloud[0], 1, 2, 3, 0.5, 15.5);
}

TEST(PointCloudPreset, ForwardLeftUpWithoutSnr) {
  struct Case {
    const char *preset, *doppler, *power;
  };
  for (const Case& c : {Case{"coloradar", "doppler", "intensity"}, Case{"oculii", "Doppler", "Power"},
                        Case{"ars548", "doppler", "intensity"}, Case{"hugin", "doppler", "power"}}) {
    PointCloud2 m = Message(1, 24)
                        .floats("x", 0, {2})
                        .floats("y", 4, {-1})
                        .floats("z", 8, {3})
                        .floats(c.power, 12, {-20})
                        .floats("range", 16, {4})
                        .floats(c.doppler, 20, {0.5F})
                        .get();
    const DecodedScan scan = decode(m, pointCloudPreset(c.preset));
    ASSERT_EQ(scan.cloud.size(), 1u) << c.preset;
    expectPoint(scan.cloud[0], 1, 2, 3, 0.5, static_cast<double>(kUnknownSnrDb));
  }
}

TEST(PointCloudPreset, Smartmicro) {
  PointCloud2 m = Message(1, 24)
                      .floats("x", 0, {2})
                      .floats("y", 4, {-1})
                      .floats("z", 8, {3})
                      .floats("radial_speed", 12, {0.5F})
                      .floats("snr", 20, {14})
                      .get();
  expectPoint(decode(m, pointCloudPreset("smartmicro")).cloud.at(0), 1, 2, 3, 0.5, 14);
}

TEST(PointCloudPreset, Ars548SphericalWithoutSize) {
  // Unaligned (33 bytes a point), and the driver sets neither width nor height.
  const float azimuth = 0.3F, elevation = -0.2F;
  PointCloud2 m = Message(2, 33)
                      .floats("azimuth", 0, {azimuth, 0})
                      .floats("elevation", 8, {elevation, 0})
                      .floats("range", 16, {10, 5})
                      .floats("velocity", 24, {-1.5F, 1})
                      .field<std::int8_t>("rcs", 32, PointField::INT8, {-7, 3})
                      .get();
  m.width = m.height = m.row_step = 0;
  const DecodedScan scan = decode(m, pointCloudPreset("ars548_hkust"));
  ASSERT_EQ(scan.cloud.size(), 2u);
  const double forward = 10 * std::cos(0.2) * std::cos(0.3), left = 10 * std::cos(0.2) * std::sin(0.3);
  expectPoint(scan.cloud[0], -left, forward, -10 * std::sin(0.2), -1.5, static_cast<double>(kUnknownSnrDb));
  expectPoint(scan.cloud[1], 0, 5, 0, 1, static_cast<double>(kUnknownSnrDb));

  m.data.pop_back();
  EXPECT_TRUE(contains(refusal(m, pointCloudPreset("ars548_hkust")), "whole number of points"));
}

TEST(PointCloudPreset, EachIsListedAndFoundByItsName) {
  for (const std::string& name : pointCloudPresets()) EXPECT_EQ(pointCloudPreset(name).name, name);
  try {
    pointCloudPreset("velodyne");
    ADD_FAILURE();
  } catch (const std::invalid_argument& error) {
    EXPECT_TRUE(contains(error.what(), "velodyne"));
    EXPECT_TRUE(contains(error.what(), "ti_mmwave"));
  }
}

// --- Overrides ---

TEST(PointCloudFormat, EveryElementCanBeOverridden) {
  PointCloudFormat f;
  f.axes = PointAxes::kForwardLeftUp;
  f.doppler_sign = -1;
  f.power_unit = PowerUnit::kSnrLinear;
  f.power = "noise_db";  // 40 as a ratio: 16.02 dB
  f.x = "z";
  f.z = "x";
  const DecodedScan scan = decode(irsMessage(), f);
  // forward 3, left 2, up 1
  expectPoint(scan.cloud.at(0), -2, 3, 1, -0.5, 10 * std::log10(40.0));
}

TEST(PointCloudFormat, SphericalInRightForwardUp) {
  PointCloudFormat f;
  f.coordinates = PointCoordinates::kSpherical;
  f.doppler = "v";
  f.power_unit = PowerUnit::kNotSnr;
  PointCloud2 m = Message(1, 16)
                      .floats("azimuth", 0, {0.5F})
                      .floats("elevation", 4, {0.25F})
                      .floats("range", 8, {2})
                      .floats("v", 12, {1})
                      .get();
  const DecodedScan scan = decode(m, f);
  expectPoint(scan.cloud.at(0), 2 * std::cos(0.25) * std::sin(0.5), 2 * std::cos(0.25) * std::cos(0.5),
              2 * std::sin(0.25), 1, static_cast<double>(kUnknownSnrDb));
}

TEST(PointCloudFormat, EveryDatatype) {
  PointCloudFormat f;
  f.doppler = "d";
  f.power = "s";
  const auto decoded = [&](PointCloud2& m) { return decode(m, f).cloud.at(0); };
  PointCloud2 a = Message(1, 40)
                      .field<double>("x", 1, PointField::FLOAT64, {1.5})
                      .field<std::int32_t>("y", 9, PointField::INT32, {-70000})
                      .field<std::uint32_t>("z", 13, PointField::UINT32, {3000000000U})
                      .field<std::int16_t>("d", 17, PointField::INT16, {-300})
                      .field<std::uint16_t>("s", 19, PointField::UINT16, {60000})
                      .get();
  const RadarPointPcl p = decoded(a);
  EXPECT_EQ(p.x, 1.5F);
  EXPECT_EQ(p.y, -70000.0F);
  EXPECT_EQ(p.z, 3e9F);
  EXPECT_EQ(p.doppler, -300.0F);
  EXPECT_EQ(p.snr_db, 60000.0F);
  PointCloud2 b = Message(1, 40)
                      .field<std::int8_t>("x", 0, PointField::INT8, {-100})
                      .field<std::uint8_t>("y", 1, PointField::UINT8, {200})
                      .floats("z", 2, {3})
                      .floats("d", 6, {4})
                      .floats("s", 10, {5})
                      .get();
  EXPECT_EQ(decoded(b).x, -100.0F);
  EXPECT_EQ(decoded(b).y, 200.0F);
}

TEST(PointCloudFormat, APowerUnitIsSetByItsName) {
  for (const PowerUnit u :
       {PowerUnit::kSnrDb, PowerUnit::kSnrDeciDb, PowerUnit::kSnrLinear, PowerUnit::kNotSnr}) {
    const Config config = makeConfig({parseAssignment("radar_power_unit=" + toString(u))});
    EXPECT_EQ(pointCloudFormat(config).power_unit, u);
  }
}

TEST(PointCloudFormat, ASignOfZeroIsRefused) {
  PointCloudFormat f;
  f.doppler_sign = 0;
  EXPECT_THROW(decode(irsMessage(), f), std::invalid_argument);
}

}  // namespace
}  // namespace rio_t
