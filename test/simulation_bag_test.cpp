#include "rio_t/ros/bag/simulation_bag.h"

#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/TwistStamped.h>
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Header.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <vector>

#include "../src/ros/temporary_folder.h"
#include "full_disk.h"
#include "rio_t/simulation/motions.h"
#include "rio_t/simulation/presets.h"

namespace rio_t {
namespace {

using simulation::Motion;
using simulation::SensorData;
using simulation::SimulationOptions;

class TemporaryFile {
 public:
  const std::string& path() const { return path_; }

 private:
  TemporaryFolder folder_;
  std::string path_ = folder_.path() + "/simulated.bag";
};

std::string contentOf(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

// What the tests write: 25 s with lost scans.
struct Written {
  explicit Written(const SimulationBagOptions& options, std::uint64_t seed = 1)
      : motion(simulation::makeMotion({"medium", seed, 25.0, simulation::MotionRestOptions{}})) {
    simulated.seed = seed;
    simulated.time_offset.constant = 0.03;
    simulated.radar.blackouts = {{15.0, 1.0}};
    data = simulation::simulate(motion, simulated);
    writeSimulationBag(file.path(), motion, data, simulated.start, options);
  }

  Motion motion;
  SimulationOptions simulated;
  SensorData data;
  TemporaryFile file;
};

std::map<std::string, std::pair<std::string, std::size_t>> topicsOf(const std::string& path) {
  rosbag::Bag bag(path, rosbag::bagmode::Read);
  std::map<std::string, std::pair<std::string, std::size_t>> topics;
  for (const rosbag::MessageInstance& message : rosbag::View(bag)) {
    topics[message.getTopic()].first = message.getDataType();
    ++topics[message.getTopic()].second;
  }
  return topics;
}

template <typename Message>
struct Received {
  Message message;
  ros::Time record_time;
};

template <typename Message>
std::vector<Received<Message>> read(const std::string& path, const std::string& topic) {
  rosbag::Bag bag(path, rosbag::bagmode::Read);
  std::vector<Received<Message>> messages;
  for (const rosbag::MessageInstance& instance : rosbag::View(bag, rosbag::TopicQuery(topic))) {
    const auto message = instance.instantiate<Message>();
    if (message == nullptr) throw std::runtime_error(topic + " is of another type");
    messages.push_back({*message, instance.getTime()});
  }
  return messages;
}

float floatAt(const sensor_msgs::PointCloud2& cloud, std::size_t point, std::size_t offset) {
  float value = 0.0F;
  std::memcpy(&value, cloud.data.data() + point * cloud.point_step + offset, sizeof(value));
  return value;
}

using Fields = std::vector<std::pair<std::string, std::uint32_t>>;

Fields fieldsOf(const sensor_msgs::PointCloud2& cloud) {
  Fields fields;
  for (const sensor_msgs::PointField& field : cloud.fields) {
    EXPECT_EQ(field.datatype, sensor_msgs::PointField::FLOAT32);
    EXPECT_EQ(field.count, 1u);
    fields.emplace_back(field.name, field.offset);
  }
  return fields;
}

std::int64_t nanoseconds(const ros::Time& time) { return static_cast<std::int64_t>(time.toNSec()); }

TEST(SimulationBag, AFullDiskIsAnErrorThatNamesTheBagAndLeavesNone) {
  const Written whole({});
  const TemporaryFile file;
  std::string told;
  {
    const FullDisk disk(100'000);
    try {
      writeSimulationBag(file.path(), whole.motion, whole.data, whole.simulated.start, {});
    } catch (const std::runtime_error& error) {
      told = error.what();
    }
  }
  EXPECT_EQ(told.find("bag '" + file.path() + "' cannot be written: "), 0U) << told;
  EXPECT_FALSE(std::filesystem::exists(file.path()));
}

TEST(SimulationBag, IrsTopicsAndTypes) {
  const Written bag{SimulationBagOptions{}};
  const auto topics = topicsOf(bag.file.path());
  ASSERT_EQ(topics.size(), 5u);
  EXPECT_EQ(topics.at("/sensor_platform/imu").first, "sensor_msgs/Imu");
  EXPECT_EQ(topics.at("/sensor_platform/radar/scan").first, "sensor_msgs/PointCloud2");
  EXPECT_EQ(topics.at("/sensor_platform/radar/trigger").first, "std_msgs/Header");
  EXPECT_EQ(topics.at("/ground_truth/pose").first, "geometry_msgs/PoseStamped");
  EXPECT_EQ(topics.at("/ground_truth/twist").first, "geometry_msgs/TwistStamped");
  EXPECT_EQ(topics.at("/sensor_platform/imu").second, bag.data.imu.samples.size());
  EXPECT_EQ(topics.at("/ground_truth/pose").second, 1251u);
  // The blackout of one second takes ten scans, their triggers remain.
  EXPECT_EQ(topics.at("/sensor_platform/radar/trigger").second, 250u);
  EXPECT_EQ(topics.at("/sensor_platform/radar/scan").second, 240u);
}

TEST(SimulationBag, IrsScansSurviveTheBag) {
  const Written bag{SimulationBagOptions{}};
  const auto scans = read<sensor_msgs::PointCloud2>(bag.file.path(), "/sensor_platform/radar/scan");
  const Fields expected = {{"x", 0},         {"y", 4},     {"z", 8}, {"snr_db", 12}, {"v_doppler_mps", 16},
                           {"noise_db", 20}, {"range", 24}};
  for (const auto& [cloud, record_time] : scans) {
    const simulation::SimulatedScan& scan = bag.data.scans.at(cloud.header.seq);
    ASSERT_EQ(fieldsOf(cloud), expected);
    EXPECT_EQ(cloud.point_step, 28u);
    EXPECT_EQ(cloud.height, 1u);
    EXPECT_EQ(cloud.header.frame_id, "radar");
    EXPECT_EQ(nanoseconds(cloud.header.stamp), scan.stamp.nanoseconds());
    EXPECT_EQ(nanoseconds(record_time) - scan.stamp.nanoseconds(), 60'000'000);
    ASSERT_EQ(cloud.width, scan.points.size());
    ASSERT_EQ(cloud.data.size(), cloud.width * 28u);
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      const simulation::SimulatedPoint& point = scan.points[i];
      EXPECT_EQ(floatAt(cloud, i, 0), static_cast<float>(point.position_R.x()));
      EXPECT_EQ(floatAt(cloud, i, 4), static_cast<float>(point.position_R.y()));
      EXPECT_EQ(floatAt(cloud, i, 8), static_cast<float>(point.position_R.z()));
      EXPECT_EQ(floatAt(cloud, i, 12), static_cast<float>(point.snr_db));
      EXPECT_EQ(floatAt(cloud, i, 16), static_cast<float>(point.doppler));
      EXPECT_EQ(floatAt(cloud, i, 20), static_cast<float>(point.noise_db));
      EXPECT_EQ(floatAt(cloud, i, 24), static_cast<float>(point.position_R.norm()));
    }
  }
  const auto triggers = read<std_msgs::Header>(bag.file.path(), "/sensor_platform/radar/trigger");
  for (const auto& [trigger, record_time] : triggers) {
    EXPECT_EQ(nanoseconds(trigger.stamp), bag.data.scans.at(trigger.seq).stamp.nanoseconds());
    EXPECT_EQ(trigger.frame_id, "radar");
  }
}

TEST(SimulationBag, ImuAndTruthSurviveTheBag) {
  const Written bag{SimulationBagOptions{}};
  const auto imu = read<sensor_msgs::Imu>(bag.file.path(), "/sensor_platform/imu");
  ASSERT_EQ(imu.size(), bag.data.imu.samples.size());
  for (std::size_t i = 0; i < imu.size(); ++i) {
    const ImuMeasurement& sample = bag.data.imu.samples[i];
    const sensor_msgs::Imu& message = imu[i].message;
    ASSERT_EQ(nanoseconds(message.header.stamp), sample.time.nanoseconds());
    ASSERT_EQ(message.header.seq, i);
    ASSERT_EQ(message.angular_velocity.x, sample.angular_velocity.x());
    ASSERT_EQ(message.angular_velocity.y, sample.angular_velocity.y());
    ASSERT_EQ(message.angular_velocity.z, sample.angular_velocity.z());
    ASSERT_EQ(message.linear_acceleration.x, sample.acceleration.x());
    ASSERT_EQ(message.linear_acceleration.y, sample.acceleration.y());
    ASSERT_EQ(message.linear_acceleration.z, sample.acceleration.z());
    ASSERT_EQ(message.orientation_covariance[0], -1.0);
  }
  EXPECT_EQ(imu.front().message.header.frame_id, "base_link");

  const auto poses = read<geometry_msgs::PoseStamped>(bag.file.path(), "/ground_truth/pose");
  const auto twists = read<geometry_msgs::TwistStamped>(bag.file.path(), "/ground_truth/twist");
  ASSERT_EQ(poses.size(), twists.size());
  const std::size_t i = 900;  // at 18 s, moving
  const simulation::MotionState truth = bag.motion.at(18.0);
  EXPECT_EQ(nanoseconds(poses[i].message.header.stamp) - bag.simulated.start.nanoseconds(), 18'000'000'000);
  EXPECT_EQ(poses[i].message.header.frame_id, "world");
  EXPECT_EQ(poses[i].message.pose.position.x, truth.p_W.x());
  EXPECT_EQ(poses[i].message.pose.position.z, truth.p_W.z());
  EXPECT_EQ(poses[i].message.pose.orientation.w, truth.q_WI.w());
  EXPECT_EQ(poses[i].message.pose.orientation.y, truth.q_WI.y());
  EXPECT_EQ(twists[i].message.twist.linear.y, truth.v_W.y());
  const Eigen::Vector3d omega_W = truth.q_WI * truth.omega_I;
  EXPECT_EQ(twists[i].message.twist.angular.z, omega_W.z());
  EXPECT_GT(truth.v_W.norm(), 0.01);
}

TEST(SimulationBag, RecordTimesAreArrivalTimesInOrder) {
  SimulationBagOptions options;
  options.record_offset = 338524.89;
  const Written bag{options};
  rosbag::Bag file(bag.file.path(), rosbag::bagmode::Read);
  const auto imu = read<sensor_msgs::Imu>(bag.file.path(), "/sensor_platform/imu");
  EXPECT_NEAR((imu.front().record_time - imu.front().message.header.stamp).toSec(), 338524.89 + 0.001, 1e-8);
  // Written in that order too: a reader of the raw file, too, sees no message early.
  ros::Time before;
  for (const rosbag::MessageInstance& message : rosbag::View(file)) {
    EXPECT_GE(message.getTime(), before);
    before = message.getTime();
  }
}

TEST(SimulationBag, TiMmwaveTopicsFieldsAndAxes) {
  SimulationBagOptions options;
  options.format = BagFormat::kTiMmwave;
  const Written bag{options};
  const auto topics = topicsOf(bag.file.path());
  ASSERT_EQ(topics.size(), 5u);
  EXPECT_EQ(topics.at("/ti_mmwave/radar_scan_pcl").first, "sensor_msgs/PointCloud2");
  EXPECT_EQ(topics.at("/sensor_platform/radar_right/trigger").first, "std_msgs/Header");
  const Fields expected = {{"x", 0}, {"y", 4}, {"z", 8}, {"intensity", 16}, {"velocity", 20}};
  const auto scans = read<sensor_msgs::PointCloud2>(bag.file.path(), "/ti_mmwave/radar_scan_pcl");
  ASSERT_EQ(scans.size(), 240u);
  for (const auto& [cloud, record_time] : scans) {
    const simulation::SimulatedScan& scan = bag.data.scans.at(cloud.header.seq);
    ASSERT_EQ(fieldsOf(cloud), expected);
    EXPECT_EQ(cloud.point_step, 32u);
    EXPECT_TRUE(cloud.header.stamp.isZero());
    EXPECT_EQ(cloud.header.frame_id, "");
    ASSERT_EQ(cloud.width, scan.points.size());
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      // (x, y, z) of RIO = (-y, x, z) of ti_mmwave
      EXPECT_EQ(-floatAt(cloud, i, 4), static_cast<float>(scan.points[i].position_R.x()));
      EXPECT_EQ(floatAt(cloud, i, 0), static_cast<float>(scan.points[i].position_R.y()));
      EXPECT_EQ(floatAt(cloud, i, 8), static_cast<float>(scan.points[i].position_R.z()));
      EXPECT_EQ(floatAt(cloud, i, 16), static_cast<float>(scan.points[i].snr_db));
      EXPECT_EQ(floatAt(cloud, i, 20), static_cast<float>(scan.points[i].doppler));
    }
  }
  for (const auto& [trigger, time] :
       read<std_msgs::Header>(bag.file.path(), "/sensor_platform/radar_right/trigger")) {
    EXPECT_EQ(nanoseconds(trigger.stamp), bag.data.scans.at(trigger.seq).stamp.nanoseconds());
  }
}

// The same motion with two radars: they differ in rate, offset and losses.
struct WrittenPair {
  explicit WrittenPair(const SimulationBagOptions& options)
      : motion(simulation::makeMotion({"medium", 1, 25.0, simulation::MotionRestOptions{}})) {
    simulated.seed = 1;
    simulation::RadarSetup left, right;
    left.time_offset.constant = 0.03;
    right.radar.rate = 20.0;
    right.radar.first_trigger = 0.06;
    right.radar.blackouts = {{15.0, 1.0}};
    simulated.radars = {{"left", left}, {"right", right}};
    data = simulation::simulate(motion, simulated);
    writeSimulationBag(file.path(), motion, data, simulated.start, options);
  }

  Motion motion;
  SimulationOptions simulated;
  SensorData data;
  TemporaryFile file;
};

TEST(SimulationBag, SeveralRadarsHaveTopicsAndFramesOfTheirOwn) {
  const WrittenPair bag{SimulationBagOptions{}};
  const auto topics = topicsOf(bag.file.path());
  ASSERT_EQ(topics.size(), 7u);
  EXPECT_EQ(topics.at("/sensor_platform/radar_left/trigger").second, 250u);
  EXPECT_EQ(topics.at("/sensor_platform/radar_left/scan").second, 250u);
  EXPECT_EQ(topics.at("/sensor_platform/radar_right/trigger").second, 499u);
  EXPECT_EQ(topics.at("/sensor_platform/radar_right/scan").second, 479u);
  for (const std::string name : {"left", "right"}) {
    const std::vector<simulation::SimulatedScan>& truth = bag.data.radars.at(name);
    const std::string prefix = "/sensor_platform/radar_" + name;
    for (const auto& [cloud, record_time] :
         read<sensor_msgs::PointCloud2>(bag.file.path(), prefix + "/scan")) {
      const simulation::SimulatedScan& scan = truth.at(cloud.header.seq);
      EXPECT_EQ(cloud.header.frame_id, "radar_" + name);
      ASSERT_EQ(nanoseconds(cloud.header.stamp), scan.stamp.nanoseconds());
      ASSERT_EQ(fieldsOf(cloud).size(), 7u);
      ASSERT_EQ(cloud.width, scan.points.size());
      for (std::size_t i = 0; i < scan.points.size(); ++i) {
        ASSERT_EQ(floatAt(cloud, i, 0), static_cast<float>(scan.points[i].position_R.x()));
        ASSERT_EQ(floatAt(cloud, i, 16), static_cast<float>(scan.points[i].doppler));
      }
    }
    for (const auto& [trigger, record_time] : read<std_msgs::Header>(bag.file.path(), prefix + "/trigger")) {
      ASSERT_EQ(nanoseconds(trigger.stamp), truth.at(trigger.seq).stamp.nanoseconds());
      EXPECT_EQ(trigger.frame_id, "radar_" + name);
    }
  }
}

TEST(SimulationBag, SeveralRadarsInTheFormatOfTiMmwave) {
  SimulationBagOptions options;
  options.format = BagFormat::kTiMmwave;
  const WrittenPair bag{options};
  ASSERT_EQ(topicsOf(bag.file.path()).size(), 7u);
  for (const std::string name : {"left", "right"}) {
    const auto scans = read<sensor_msgs::PointCloud2>(bag.file.path(), "/ti_mmwave/radar_scan_pcl_" + name);
    ASSERT_GT(scans.size(), 200u);
    for (const auto& [cloud, record_time] : scans) {
      ASSERT_EQ(cloud.width, bag.data.radars.at(name).at(cloud.header.seq).points.size());
      EXPECT_TRUE(cloud.header.stamp.isZero());
      EXPECT_EQ(cloud.header.frame_id, "");
      ASSERT_EQ(fieldsOf(cloud).size(), 5u);
    }
    const auto triggers =
        read<std_msgs::Header>(bag.file.path(), "/sensor_platform/radar_" + name + "/trigger");
    ASSERT_GT(triggers.size(), 200u);
    for (const auto& [trigger, record_time] : triggers) EXPECT_EQ(trigger.frame_id, "radar_" + name);
  }
}

/// As it is written; the messages of Ubuntu 20.04 have no ==.
template <typename Message>
std::vector<std::uint8_t> bytesOf(const Message& message) {
  std::vector<std::uint8_t> bytes(ros::serialization::serializationLength(message));
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, message);
  return bytes;
}

// Every message of the topic, with its record time.
template <typename Message>
bool sameMessages(const std::string& a, const std::string& b, const std::string& topic) {
  const auto first = read<Message>(a, topic), second = read<Message>(b, topic);
  EXPECT_FALSE(first.empty());
  return std::equal(first.begin(), first.end(), second.begin(), second.end(),
                    [](const auto& x, const auto& y) {
                      return x.record_time == y.record_time && bytesOf(x.message) == bytesOf(y.message);
                    });
}

TEST(SimulationBag, SeveralRadarsLeaveImuAndTruthAsTheyAre) {
  const Written one{SimulationBagOptions{}};
  const WrittenPair two{SimulationBagOptions{}};
  const std::string &a = one.file.path(), &b = two.file.path();
  EXPECT_TRUE(sameMessages<sensor_msgs::Imu>(a, b, "/sensor_platform/imu"));
  EXPECT_TRUE(sameMessages<geometry_msgs::PoseStamped>(a, b, "/ground_truth/pose"));
  EXPECT_TRUE(sameMessages<geometry_msgs::TwistStamped>(a, b, "/ground_truth/twist"));
}

TEST(SimulationBag, SeveralRadarsGiveTheSameBytesAndArriveInOrder) {
  const WrittenPair first{SimulationBagOptions{}}, second{SimulationBagOptions{}};
  EXPECT_TRUE(contentOf(first.file.path()) == contentOf(second.file.path()));
  rosbag::Bag file(first.file.path(), rosbag::bagmode::Read);
  ros::Time before;
  std::string sequence;  // L and R, in the order of their triggers
  for (const rosbag::MessageInstance& message : rosbag::View(file)) {
    EXPECT_GE(message.getTime(), before);
    before = message.getTime();
    if (message.getTopic() == "/sensor_platform/radar_left/trigger") sequence += 'L';
    if (message.getTopic() == "/sensor_platform/radar_right/trigger") sequence += 'R';
  }
  EXPECT_EQ(sequence.substr(0, 9), "LRRLRRLRR");
}

TEST(SimulationBag, SameRequestSameBytesOtherSeedOtherBytes) {
  const Written first{SimulationBagOptions{}};
  const Written second{SimulationBagOptions{}};
  const Written other(SimulationBagOptions{}, 2);
  const std::string content = contentOf(first.file.path());
  EXPECT_GT(content.size(), 1'000'000u);
  EXPECT_TRUE(content == contentOf(second.file.path()));
  EXPECT_FALSE(content == contentOf(other.file.path()));
}

TEST(SimulationBag, AKartGivesTheSameBytesAndNoEmptyClouds) {
  const auto write = [](const std::string& path, std::uint64_t seed) {
    simulation::Preset kart = simulation::presetOf("kart");
    kart.options.seed = seed;
    const Motion motion = simulation::makeMotion({kart.motion, seed, 40.0, kart.rest});
    SensorData data = simulation::simulate(motion, kart.options);
    writeSimulationBag(path, motion, data, kart.options.start, SimulationBagOptions{});
    return data;
  };
  const TemporaryFile first, second, other;
  const SensorData data = write(first.path(), 1);
  write(second.path(), 1);
  write(other.path(), 2);
  EXPECT_TRUE(contentOf(first.path()) == contentOf(second.path()));
  EXPECT_FALSE(contentOf(first.path()) == contentOf(other.path()));

  const auto scans = read<sensor_msgs::PointCloud2>(first.path(), "/sensor_platform/radar/scan");
  for (const auto& [cloud, record_time] : scans) ASSERT_GT(cloud.width, 0u);
  std::size_t empty = 0;
  for (const simulation::SimulatedScan& scan : data.scans) empty += scan.points.empty() ? 1 : 0;
  EXPECT_GT(empty, 0u);
  EXPECT_EQ(scans.size() + empty, data.scans.size());
}

TEST(SimulationBag, EmptyCloudsAreWrittenWhereTheyArePublished) {
  const Motion motion = simulation::makeMotion({"easy", 1, 25.0, simulation::MotionRestOptions{}});
  SimulationOptions options;
  options.radar.points_mean = 1.0;
  options.radar.points_sigma = 1.0;
  options.radar.points_min = 0;
  const SensorData data = simulation::simulate(motion, options);
  const TemporaryFile file;
  writeSimulationBag(file.path(), motion, data, options.start, SimulationBagOptions{});
  const auto scans = read<sensor_msgs::PointCloud2>(file.path(), "/sensor_platform/radar/scan");
  EXPECT_EQ(scans.size(), data.scans.size());
  std::size_t empty = 0;
  for (const auto& [cloud, record_time] : scans) {
    if (cloud.width > 0) continue;
    ++empty;
    EXPECT_EQ(fieldsOf(cloud).size(), 7u);
    EXPECT_TRUE(cloud.data.empty());
  }
  EXPECT_GT(empty, 20u);
}

TEST(SimulationBag, NamesTheFileThatCannotBeWritten) {
  const Motion motion = simulation::makeMotion({"easy", 1, 25.0, simulation::MotionRestOptions{}});
  const SimulationOptions options;
  try {
    writeSimulationBag("/nowhere/at/all.bag", motion, simulation::simulate(motion, options), options.start,
                       SimulationBagOptions{});
    FAIL() << "no exception";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("/nowhere/at/all.bag"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace rio_t
