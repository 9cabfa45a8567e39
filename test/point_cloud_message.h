#pragma once

#include <gtest/gtest.h>
#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/PointField.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "rio_t/ros/cloud/point_cloud.h"

namespace rio_t {

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
    sensor_msgs::PointField f;
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
    return field(name, offset, sensor_msgs::PointField::FLOAT32, values);
  }
  sensor_msgs::PointCloud2& get() { return message_; }

 private:
  sensor_msgs::PointCloud2 message_;
};

/// Two points of the IRS format: right 1, forward 2, up 3, receding at 0.5 m/s, 20 dB; and another.
inline sensor_msgs::PointCloud2 irsMessage() {
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

inline void expectPoint(const RadarPointPcl& p, double right, double forward, double up, double doppler,
                        double snr_db) {
  EXPECT_NEAR(p.x, right, 1e-5);
  EXPECT_NEAR(p.y, forward, 1e-5);
  EXPECT_NEAR(p.z, up, 1e-5);
  EXPECT_NEAR(p.doppler, doppler, 1e-6);
  EXPECT_NEAR(p.snr_db, snr_db, 1e-5);
}

/// The message of the exception that decoding ends with.
inline std::string refusal(const sensor_msgs::PointCloud2& message, const PointCloudFormat& format) {
  try {
    decode(message, format);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  ADD_FAILURE() << "decoded, but should not have been";
  return "";
}

inline testing::AssertionResult contains(const std::string& text, const std::string& part) {
  if (text.find(part) != std::string::npos) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "no '" << part << "' in: " << text;
}

}  // namespace rio_t
