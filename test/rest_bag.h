#pragma once

#include <geometry_msgs/PoseStamped.h>
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/point_cloud2_iterator.h>
#include <std_msgs/Header.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "../src/ros/temporary_folder.h"
#include "rio_t/ros/bag/bag_runner.h"
#include "run_files.h"

namespace rio_t {

struct Outcome {
  int status = 0;
  std::string out, err;
};

inline Outcome runTool(const std::vector<std::string>& words) {
  std::ostringstream out, err;
  const int status = runBagTool(words, out, err);
  return {status, out.str(), err.str()};
}

/// What a test bag holds.
struct BagContents {
  double duration = 8.0;  ///< [s]
  bool imu = true;
  bool radar = true;
  int points = 30;       ///< of each scan
  double doppler = 0.0;  ///< of each point [m/s], alternating sign
  bool stamped = true;
  bool imu_stamped = true;
  double jump = 0.0;     ///< [s] by which the stamps jump ahead at `jump_at`
  double jump_at = 8.0;  ///< [s]
  double shaking = 0.0;  ///< amplitude of the gyro [rad/s]
  std::string doppler_field = "v_doppler_mps";
  bool ground_truth = false;
  std::vector<std::string> radar_topics = {"/sensor_platform/radar/scan"};
  std::string cloud_frame{};
};

/// A platform at rest with the IRS topics, recorded by a clock 100 s ahead.
class RestBag : public testing::Test {
 protected:
  void SetUp() override {
    bag_ = folder_ + "/test.bag";
    out_ = folder_ + "/out";
  }

  void writeBag(const BagContents& what) const {
    rosbag::Bag bag(bag_, rosbag::bagmode::Write);
    const int steps = static_cast<int>(what.duration * 200.0);
    for (int k = 0; k < steps; ++k) {
      const double t = 0.005 * k;
      const ros::Time on_time = ros::Time(1000.0) + ros::Duration(t);
      const ros::Time record = on_time + ros::Duration(100.001);
      const ros::Time stamp = on_time + ros::Duration(t < what.jump_at ? 0.0 : what.jump);
      if (what.imu) {
        sensor_msgs::Imu imu;
        if (what.imu_stamped) imu.header.stamp = stamp;
        imu.linear_acceleration.z = 9.81;
        imu.angular_velocity.x = what.shaking * std::sin(20.0 * t);
        bag.write("/sensor_platform/imu", record, imu);
      }
      if (what.radar && k % 20 == 0) writeCloud(what, stamp, record, k / 20, &bag);
      if (what.ground_truth && k % 4 == 0) {
        geometry_msgs::PoseStamped pose;
        pose.header.stamp = stamp;
        pose.pose.position.x = 5.0;
        pose.pose.orientation.w = 1.0;
        bag.write("/ground_truth/pose", record, pose);
      }
    }
    std_msgs::Header other;
    other.stamp = ros::Time(1000.0);
    bag.write("/other", ros::Time(1100.0), other);
  }

  void writeCloud(const BagContents& what, const ros::Time& stamp, const ros::Time& record, int seq,
                  rosbag::Bag* bag) const {
    sensor_msgs::PointCloud2 cloud;
    if (what.stamped) cloud.header.stamp = stamp;
    cloud.header.seq = static_cast<std::uint32_t>(seq);
    cloud.header.frame_id = what.cloud_frame;
    sensor_msgs::PointCloud2Modifier modifier(cloud);
    modifier.setPointCloud2Fields(5, "x", 1, sensor_msgs::PointField::FLOAT32, "y", 1,
                                  sensor_msgs::PointField::FLOAT32, "z", 1, sensor_msgs::PointField::FLOAT32,
                                  "snr_db", 1, sensor_msgs::PointField::FLOAT32, what.doppler_field.c_str(),
                                  1, sensor_msgs::PointField::FLOAT32);
    modifier.resize(static_cast<std::size_t>(what.points));
    // An iterator refers to the first byte at once, which an empty cloud does not have.
    if (what.points > 0) writePoints(what, &cloud);
    for (const std::string& topic : what.radar_topics)
      bag->write(topic, record + ros::Duration(0.0005), cloud);
  }

  static void writePoints(const BagContents& what, sensor_msgs::PointCloud2* cloud) {
    sensor_msgs::PointCloud2Iterator<float> x(*cloud, "x");
    for (int i = 0; i < what.points; ++i, ++x) {
      const double azimuth = 0.9 * std::sin(1.0 + 2.4 * i);
      x[0] = static_cast<float>(4.0 * std::sin(azimuth));
      x[1] = static_cast<float>(4.0 * std::cos(azimuth));
      x[2] = static_cast<float>(1.5 * std::sin(0.7 * i));
      x[3] = 20.0F;
      x[4] = static_cast<float>((i % 2 == 0 ? 1.0 : -1.0) * what.doppler);
    }
  }

  Outcome run(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words = {"--bag", bag_, "--config", "irs", "--output-dir", out_};
    words.insert(words.end(), more.begin(), more.end());
    return runTool(words);
  }

  /// One line on stderr that holds every part, then perhaps the likely causes; and that exit status.
  void expectError(const Outcome& outcome, const std::vector<std::string>& parts, int status = 1) const {
    EXPECT_EQ(outcome.status, status);
    EXPECT_EQ(outcome.out, "");
    const std::string line = outcome.err.substr(0, outcome.err.find("The most likely causes:\n"));
    EXPECT_EQ(std::count(line.begin(), line.end(), '\n'), 1) << outcome.err;
    for (const std::string& part : parts)
      EXPECT_NE(outcome.err.find(part), std::string::npos) << part << " not in: " << outcome.err;
  }

  const TemporaryFolder temporary_;
  const std::string folder_ = temporary_.path();
  std::string bag_, out_;
};

}  // namespace rio_t
