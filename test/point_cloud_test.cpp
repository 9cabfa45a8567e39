// Point clouds: what is refused, what is decoded, and the way to the core and back.
#include "rio_t/ros/cloud/point_cloud.h"

#include <gtest/gtest.h>
#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/PointField.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "point_cloud_message.h"
#include "rio_t/ros/parameters/point_cloud_format.h"

namespace rio_t {
namespace {

using sensor_msgs::PointCloud2;
using sensor_msgs::PointField;

// --- What is refused ---

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

// --- What is accepted ---

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
  m.point_step = 0;
  EXPECT_EQ(decode(m, PointCloudFormat()).cloud.size(), 0u);
  m.width = 1;
  m.height = 0;
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

/// Drivers fill clouds of a fixed size up with zeros, or with NaN.
TEST(PointCloudDecode, PaddingIsNoPoint) {
  for (const std::uint8_t byte : {std::uint8_t{0x00}, std::uint8_t{0xff}}) {
    PointCloud2 m = irsMessage();
    std::fill(m.data.begin(), m.data.begin() + 12, byte);
    const DecodedScan scan = decode(m, PointCloudFormat());
    EXPECT_EQ(scan.cloud.size(), 1u);
    EXPECT_EQ(scan.padding, 1u);
    EXPECT_EQ(scan.dropped_not_finite, 0u);
  }
}

TEST(PointCloudDecode, ADoubleTooSmallForAFloatIsZero) {
  PointCloudFormat f;
  f.power_unit = PowerUnit::kNotSnr;
  f.doppler = "d";
  const PointCloud2 m = Message(1, 32)
                            .field<double>("x", 0, PointField::FLOAT64, {0})
                            .field<double>("y", 8, PointField::FLOAT64, {1e-300})
                            .field<double>("z", 16, PointField::FLOAT64, {0})
                            .field<double>("d", 24, PointField::FLOAT64, {1})
                            .get();
  const DecodedScan scan = decode(m, f);
  EXPECT_EQ(scan.padding, 1u);
  EXPECT_TRUE(scan.cloud.empty());
}

// --- To the core and back ---

TEST(PointCloudConversion, MarksWhatIsAmbiguous) {
  PointCloud2 m = irsMessage();
  const auto isAmbiguous = [&](const PointCloudFormat& format) {
    const RadarScan scan = toRadarScan(decode(m, format).cloud, Time());
    return scan.points[0].is_ambiguous && scan.points[1].is_ambiguous;
  };
  EXPECT_FALSE(isAmbiguous(PointCloudFormat()));
  // The second point is that of the first, on the other side.
  std::copy_n(m.data.begin(), m.point_step, m.data.begin() + m.point_step);
  const float x = -1.0F;
  std::memcpy(&m.data[m.point_step], &x, sizeof(x));
  EXPECT_TRUE(isAmbiguous(PointCloudFormat()));
}

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
