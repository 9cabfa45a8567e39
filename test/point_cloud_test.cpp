#include "rio_t/ros/cloud/point_cloud.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace rio_t {
namespace {

using sensor_msgs::PointCloud2;
using sensor_msgs::PointField;

/// A message built byte by byte, as the drivers' own descriptions have it.
class Message {
 public:
  Message(std::uint32_t points, std::uint32_t point_step) {
    message_.width = points;
    message_.height = 1;
    message_.point_step = point_step;
    message_.row_step = points * point_step;
    message_.data.assign(std::size_t{points} * point_step, 0xEE);  // padding is rubbish
  }
  template <typename T>
  Message& field(const std::string& name, std::uint32_t offset, std::uint8_t datatype,
                 const std::vector<T>& values) {
    PointField f;
    f.name = name;
    f.offset = offset;
    f.datatype = datatype;
    f.count = 1;
    message_.fields.push_back(f);
    for (std::size_t i = 0; i < values.size(); ++i) {
      std::memcpy(&message_.data[i * message_.point_step + offset], &values[i], sizeof(T));
    }
    return *this;
  }
  Message& floats(const std::string& name, std::uint32_t offset, const std::vector<float>& values) {
    return field(name, offset, PointField::FLOAT32, values);
  }
  PointCloud2& get() { return message_; }

 private:
  PointCloud2 message_;
};

/// Two points of the IRS format: right 1, forward 2, up 3, receding at 0.5 m/s, 20 dB; and another.
PointCloud2 irsMessage() {
  return Message(2, 28)
      .floats("x", 0, {1, -1})
      .floats("y", 4, {2, 4})
      .floats("z", 8, {3, 0.5F})
      .floats("snr_db", 12, {20, 11})
      .floats("v_doppler_mps", 16, {0.5F, -0.25F})
      .floats("noise_db", 20, {40, 41})
      .floats("range", 24, {3.7F, 4.2F})
      .get();
}

void expectPoint(const RadarPointPcl& p, double right, double forward, double up, double doppler,
                 double snr_db) {
  EXPECT_NEAR(p.x, right, 1e-5);
  EXPECT_NEAR(p.y, forward, 1e-5);
  EXPECT_NEAR(p.z, up, 1e-5);
  EXPECT_NEAR(p.doppler, doppler, 1e-6);
  EXPECT_NEAR(p.snr_db, snr_db, 1e-5);
}

/// The message of the exception that decoding ends with.
std::string refusal(const PointCloud2& message, const PointCloudFormat& format) {
  try {
    decode(message, format);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  ADD_FAILURE() << "decoded, but should not have been";
  return "";
}

testing::AssertionResult contains(const std::string& text, const std::string& part) {
  if (text.find(part) != std::string::npos) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "no '" << part << "' in: " << text;
}

// --- The presets
// ----------------------------------------------------------------------------------------------------

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

// --- Overrides
// ------------------------------------------------------------------------------------------------------

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

TEST(PointCloudFormat, NamesOfTheChoices) {
  for (const PointAxes a : {PointAxes::kRightForwardUp, PointAxes::kForwardLeftUp}) {
    EXPECT_EQ(pointAxesFromString(toString(a)), a);
  }
  for (const PointCoordinates c : {PointCoordinates::kCartesian, PointCoordinates::kSpherical}) {
    EXPECT_EQ(pointCoordinatesFromString(toString(c)), c);
  }
  for (const PowerUnit u :
       {PowerUnit::kSnrDb, PowerUnit::kSnrDeciDb, PowerUnit::kSnrLinear, PowerUnit::kNotSnr}) {
    EXPECT_EQ(powerUnitFromString(toString(u)), u);
  }
  EXPECT_THROW(pointAxesFromString("ned"), std::invalid_argument);
  EXPECT_THROW(pointCoordinatesFromString(""), std::invalid_argument);
  EXPECT_THROW(powerUnitFromString("watt"), std::invalid_argument);
  PointCloudFormat f;
  f.doppler_sign = 0;
  EXPECT_THROW(decode(irsMessage(), f), std::invalid_argument);
}

// --- What is refused
// ------------------------------------------------------------------------------------------------

TEST(PointCloudRefusal, NamesTheMissingFieldAndThePresetThatFits) {
  const std::string why = refusal(irsMessage(), pointCloudPreset("ti_mmwave"));
  EXPECT_TRUE(contains(why, "needs the field 'velocity'"));
  EXPECT_TRUE(contains(why, "fields received: x, y, z, snr_db, v_doppler_mps, noise_db, range"));
  EXPECT_TRUE(contains(why, "presets known: irs, ti_mmwave, eth"));
  EXPECT_TRUE(contains(why, "the preset 'irs' fits"));
}

TEST(PointCloudRefusal, DoesNotGuessWhereTwoPresetsFit) {
  PointCloud2 m = irsMessage();
  m.fields[3].name = "intensity";
  m.fields[4].name = "doppler";
  const std::string why = refusal(m, pointCloudPreset("irs"));
  EXPECT_TRUE(contains(why, "more than one preset fits: coloradar, ars548"));
}

TEST(PointCloudRefusal, NothingFits) {
  PointCloud2 m = irsMessage();
  m.fields[4].name = "speed";
  EXPECT_TRUE(contains(refusal(m, pointCloudPreset("irs")), "none fits"));
  m.fields.clear();
  EXPECT_TRUE(contains(refusal(m, pointCloudPreset("irs")), "fields received: none"));
}

TEST(PointCloudRefusal, TheOldTiCloudHasNoDoppler) {
  PointCloud2 m = Message(1, 32)
                      .floats("x", 0, {2})
                      .floats("y", 4, {-1})
                      .floats("z", 8, {3})
                      .floats("intensity", 16, {12.5F})
                      .get();
  for (const char* preset : {"ti_mmwave", "irs"}) {
    EXPECT_TRUE(
        contains(refusal(m, pointCloudPreset(preset)), "radar-lab ti_mmwave driver, which has no Doppler"));
  }
}

TEST(PointCloudRefusal, TruncatedData) {
  const PointCloudFormat irs;
  PointCloud2 m = irsMessage();
  m.data.pop_back();
  EXPECT_TRUE(contains(refusal(m, irs), "shorter"));
  m.data.clear();
  EXPECT_TRUE(contains(refusal(m, irs), "shorter"));
}

TEST(PointCloudRefusal, SizesThatOverflow) {
  const PointCloudFormat irs;
  PointCloud2 m = irsMessage();
  m.width = 0xFFFFFFFFU;
  EXPECT_TRUE(contains(refusal(m, irs), "shorter"));

  m = irsMessage();
  m.height = 0xFFFFFFFFU;
  m.row_step = 0xFFFFFFFFU;
  EXPECT_TRUE(contains(refusal(m, irs), "shorter"));

  // width * point_step is 2^32, which is nothing at all in 32 bits.
  m = irsMessage();
  m.point_step = 0x10000000U;
  m.width = 16;
  EXPECT_TRUE(contains(refusal(m, irs), "shorter"));

  m = irsMessage();
  m.width = m.height = m.row_step = m.point_step = 0xFFFFFFFFU;
  EXPECT_TRUE(contains(refusal(m, irs), "shorter"));
}

TEST(PointCloudRefusal, FieldPastThePoint) {
  const PointCloudFormat irs;
  PointCloud2 m = irsMessage();
  m.fields[4].offset = 25;  // 25 + 4 > 28
  EXPECT_TRUE(contains(refusal(m, irs), "'v_doppler_mps' at offset 25"));
  m.fields[4].offset = 0xFFFFFFFEU;  // + 4 wraps in 32 bits
  EXPECT_TRUE(contains(refusal(m, irs), "'v_doppler_mps' at offset 4294967294"));
  m = irsMessage();
  m.fields[4].datatype = PointField::FLOAT64;
  m.fields[4].offset = 24;
  EXPECT_TRUE(contains(refusal(m, irs), "8 bytes does not fit"));
}

TEST(PointCloudRefusal, WrongFieldDescriptions) {
  const PointCloudFormat irs;
  PointCloud2 m = irsMessage();
  m.fields[0].datatype = 42;
  EXPECT_TRUE(contains(refusal(m, irs), "'x' has the unknown datatype 42"));
  m.fields[0].datatype = 0;
  EXPECT_TRUE(contains(refusal(m, irs), "unknown datatype 0"));
  m = irsMessage();
  m.fields[1].count = 3;
  EXPECT_TRUE(contains(refusal(m, irs), "'y' holds 3 values"));
  m = irsMessage();
  m.fields[5].name = "x";
  EXPECT_TRUE(contains(refusal(m, irs), "'x' is there twice"));
}

TEST(PointCloudRefusal, WrongSteps) {
  const PointCloudFormat irs;
  PointCloud2 m = irsMessage();
  m.point_step = 0;
  refusal(m, irs);
  m = irsMessage();
  m.width = 1;
  m.height = 2;
  m.row_step = 12;  // rows would overlap
  EXPECT_TRUE(contains(refusal(m, irs), "row_step"));
}

TEST(PointCloudRefusal, DataWithoutSize) {
  PointCloud2 m = irsMessage();
  m.width = 0;
  EXPECT_TRUE(contains(refusal(m, PointCloudFormat()), "width or height is zero"));
  EXPECT_TRUE(contains(refusal(m, PointCloudFormat()), "radar_cloud_size: from_data"));
}

// --- What is accepted
// -----------------------------------------------------------------------------------------------

TEST(PointCloudDecode, RowsWithPadding) {
  // Two rows of one point each, 7 bytes of padding between them and none after the last.
  const PointCloud2 dense = irsMessage();
  PointCloud2 m = dense;
  m.width = 1;
  m.height = 2;
  m.row_step = 35;
  m.data.assign(63, 0xEE);
  std::copy(dense.data.begin(), dense.data.begin() + 28, m.data.begin());
  std::copy(dense.data.begin() + 28, dense.data.end(), m.data.begin() + 35);
  const DecodedScan scan = decode(m, PointCloudFormat());
  ASSERT_EQ(scan.cloud.size(), 2u);
  expectPoint(scan.cloud[1], -1, 4, 0.5, -0.25, 11);
}

TEST(PointCloudDecode, OneRowNeedsNoRowStep) {
  PointCloud2 m = irsMessage();
  m.row_step = 0;
  EXPECT_EQ(decode(m, PointCloudFormat()).cloud.size(), 2u);
}

TEST(PointCloudDecode, Empty) {
  PointCloud2 m = irsMessage();
  m.width = m.row_step = 0;
  m.data.clear();
  EXPECT_EQ(decode(m, PointCloudFormat()).cloud.size(), 0u);
  EXPECT_EQ(decode(PointCloud2(), PointCloudFormat()).cloud.size(), 0u);
}

TEST(PointCloudDecode, NotFiniteIsDroppedAndCounted) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  for (const char* broken : {"x", "y", "z", "v_doppler_mps", "snr_db"}) {
    for (const float value : {nan, inf, -inf}) {
      PointCloud2 m = irsMessage();
      for (const PointField& f : m.fields) {
        if (f.name == broken) std::memcpy(&m.data[f.offset], &value, sizeof value);
      }
      const DecodedScan scan = decode(m, PointCloudFormat());
      EXPECT_EQ(scan.dropped_not_finite, 1u) << broken;
      ASSERT_EQ(scan.cloud.size(), 1u);
      expectPoint(scan.cloud[0], -1, 4, 0.5, -0.25, 11);
    }
  }
  // What is not read does no harm.
  PointCloud2 m = irsMessage();
  std::memcpy(&m.data[20], &nan, sizeof nan);
  EXPECT_EQ(decode(m, PointCloudFormat()).cloud.size(), 2u);
}

TEST(PointCloudDecode, BothByteOrders) {
  PointCloudFormat f;
  f.doppler = "d";
  f.power = "s";
  PointCloud2 m = Message(2, 21)
                      .floats("x", 1, {1.5F, -1})
                      .field<double>("y", 5, PointField::FLOAT64, {2.25, 4})
                      .field<std::int8_t>("z", 13, PointField::INT8, {-3, 3})
                      .floats("d", 14, {-0.5F, 1})
                      .field<std::uint16_t>("s", 18, PointField::UINT16, {300, 11})
                      .get();
  const DecodedScan same = decode(m, f);
  m.is_bigendian = m.is_bigendian ? 0 : 1;
  for (std::size_t point = 0; point < m.data.size(); point += m.point_step) {
    for (const auto& [offset, size] :
         {std::pair(1, 4), std::pair(5, 8), std::pair(14, 4), std::pair(18, 2)}) {
      const auto bytes = m.data.begin() + static_cast<std::ptrdiff_t>(point) + offset;
      std::reverse(bytes, bytes + size);
    }
  }
  for (const DecodedScan& scan : {same, decode(m, f)}) {
    ASSERT_EQ(scan.cloud.size(), 2u);
    expectPoint(scan.cloud[0], 1.5, 2.25, -3, -0.5, 300);
    expectPoint(scan.cloud[1], -1, 4, 3, 1, 11);
  }
}

TEST(PointCloudDecode, ADoubleTooLargeForAFloatIsNotFinite) {
  PointCloudFormat f;
  f.power_unit = PowerUnit::kNotSnr;
  f.doppler = "d";
  PointCloud2 m = Message(2, 40)
                      .field<double>("x", 0, PointField::FLOAT64, {1e300, 1})
                      .field<double>("y", 8, PointField::FLOAT64, {1, 1})
                      .field<double>("z", 16, PointField::FLOAT64, {1, 1})
                      .field<double>("d", 24, PointField::FLOAT64, {1, 1})
                      .get();
  EXPECT_EQ(decode(m, f).dropped_not_finite, 1u);
}

TEST(PointCloudDecode, TheOriginIsKept) {
  PointCloud2 m = irsMessage();
  std::fill(m.data.begin(), m.data.begin() + 12, std::uint8_t{0});
  EXPECT_EQ(decode(m, PointCloudFormat()).cloud.size(), 2u);
}

// --- To the core and back
// -------------------------------------------------------------------------------------------

TEST(PointCloudConversion, ToScanAndBack) {
  const Time stamp = Time::fromNanoseconds(1700000000123456789);
  const RadarScan scan = toRadarScan(decode(irsMessage(), PointCloudFormat()).cloud, stamp);
  EXPECT_EQ(scan.stamp, stamp);
  ASSERT_EQ(scan.points.size(), 2u);
  EXPECT_EQ(scan.points[0].position_R, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(scan.points[0].doppler, 0.5);
  EXPECT_EQ(scan.points[0].snr_db, 20.0);

  const PointCloud2 inliers = toPointCloud2(scan, {1});
  PointCloudFormat ours;
  ours.doppler = "doppler";
  const DecodedScan back = decode(inliers, ours);
  ASSERT_EQ(back.cloud.size(), 1u);
  expectPoint(back.cloud[0], 4, 1, 0.5, -0.25, 11);  // as we publish: x forward, y left, z up

  EXPECT_EQ(decode(toPointCloud2(scan, {}), ours).cloud.size(), 0u);
  EXPECT_THROW(toPointCloud2(scan, {2}), std::out_of_range);
}

}  // namespace
}  // namespace rio_t
