// Bags, parameters and arguments with which no run is possible: one line says why.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <string>

#include "full_disk.h"
#include "rest_bag.h"
#include "rio_t/ros/bag/run_output.h"

namespace rio_t {
namespace {

using BagRunnerErrors = RestBag;

TEST_F(BagRunnerErrors, MissingBagFolderAndUnreadableBagAreNamed) {
  expectError(run(), {bag_, "no such file"});
  EXPECT_FALSE(fs::exists(out_));
  bag_ = folder_;
  expectError(run(), {folder_, "folder"});
  bag_ = folder_ + "/text.bag";
  std::ofstream(bag_) << "not a bag at all, but long enough to be looked at\n";
  expectError(run(), {bag_, "cannot be read as a ROS 1 bag"});
  EXPECT_EQ(run().err.find("reindex"), std::string::npos) << "it is no bag";
  std::ofstream(bag_, std::ios::trunc).close();
  expectError(run(), {bag_});
}

TEST_F(BagRunnerErrors, AnUnindexedBagIsToldToBeReindexed) {
  writeBag({});
  // A recording that was cut off has no index: its header says that the index starts at 0.
  std::string bytes = contents(bag_);
  const std::size_t at = bytes.find("index_pos=");
  ASSERT_NE(at, std::string::npos);
  for (std::size_t i = 0; i < 8; ++i) bytes[at + 10 + i] = 0;
  std::ofstream(bag_, std::ios::binary) << bytes;
  expectError(run(), {bag_, "rosbag reindex"});
}

TEST_F(BagRunnerErrors, ATruncatedOrDamagedBagIsNamed) {
  writeBag({});
  const std::string bytes = contents(bag_);
  std::ofstream(bag_, std::ios::binary) << bytes.substr(0, bytes.size() / 2);
  expectError(run(), {bag_, "perhaps cut off", "rosbag reindex " + bag_});
  // Damage in the middle of the data.
  std::string damaged = bytes;
  for (std::size_t i = 0; i < 2000; ++i) damaged[bytes.size() / 2 + i] = static_cast<char>(i * 37);
  std::ofstream(bag_, std::ios::binary | std::ios::trunc) << damaged;
  expectError(run(), {bag_, "perhaps it is damaged"});
}

TEST_F(BagRunnerErrors, TwoRunsDoNotWriteIntoOneFolder) {
  writeBag({});
  const RunOutput other(out_);
  expectError(run(), {"output folder", out_, "another run"});
}

TEST_F(BagRunnerErrors, MissingTopicsListThoseOfTheBag) {
  BagContents what;
  what.radar = false;
  writeBag(what);
  expectError(run(), {"no topic /sensor_platform/radar/scan", "radar_topic",
                      "/sensor_platform/imu (sensor_msgs/Imu)", "/other (std_msgs/Header)"});
  expectError(run({"--set", "radar_topic=/r", "--set", "imu_topic=/i"}), {"no topic /i", "no topic /r"});
  writeBag({});
  expectError(run({"--set", "stamp_source=trigger"}),
              {"no topic /sensor_platform/radar/trigger", "trigger_topic"});
}

TEST_F(BagRunnerErrors, WrongTypesAreNamed) {
  writeBag({});
  expectError(run({"--set", "radar_topic=/sensor_platform/imu", "--set", "imu_topic=/other"}),
              {"/sensor_platform/imu (radar_topic) is sensor_msgs/Imu", "expected sensor_msgs/PointCloud2"});
  expectError(run({"--set", "ground_truth_topic=/other"}),
              {"/other (ground_truth_topic) is std_msgs/Header"});
}

TEST_F(BagRunnerErrors, ATopicOfTwoTypesIsRefusedWhicheverBagComesFirst) {
  writeBag({});
  const std::string other = folder_ + "/other.bag";
  rosbag::Bag(other, rosbag::bagmode::Write)
      .write("/sensor_platform/imu", ros::Time(1200.0), std_msgs::Header());
  for (const std::vector<std::string>& bags : {std::vector<std::string>{bag_, other}, {other, bag_}}) {
    expectError(runTool({bags[0], bags[1], "--config", "irs", "--output-dir", out_}),
                {"topic /sensor_platform/imu (imu_topic) is sensor_msgs/Imu and std_msgs/Header, expected "
                 "sensor_msgs/Imu\n"});
    EXPECT_FALSE(fs::exists(out_));
  }
}

TEST_F(BagRunnerErrors, AWrongCloudFormatIsNamed) {
  BagContents what;
  what.doppler_field = "speed";
  writeBag(what);
  expectError(run(), {"/sensor_platform/radar/scan", "v_doppler_mps", "speed"});
  EXPECT_EQ(run({"--set", "radar_field_doppler=speed"}).status, 0);
}

TEST_F(BagRunnerErrors, ZeroStampsAreNamedWithTheOtherSources) {
  BagContents what;
  what.stamped = false;
  writeBag(what);
  expectError(run(), {"/sensor_platform/radar/scan", "zero", "trigger", "arrival"});
  EXPECT_EQ(run({"--set", "stamp_source=arrival"}).status, 0);
  what.stamped = true;
  what.imu_stamped = false;
  writeBag(what);
  expectError(run(), {"/sensor_platform/imu", "zero"});
}

TEST_F(BagRunnerErrors, AFaultOfMostMessagesIsNamedThoughOthersAreGood) {
  const ros::Time stamp(1004.01), record = stamp + ros::Duration(100.0);
  const auto write_with_one = [&](const BagContents& what, const BagContents& odd) {
    writeBag(what);
    rosbag::Bag bag(bag_, rosbag::bagmode::Append);
    writeCloud(odd, stamp, record, 0, &bag);
  };
  BagContents of_other_field, empty, unstamped, what;
  of_other_field.doppler_field = "speed";
  empty.points = 0;
  write_with_one(of_other_field, empty);
  expectError(run(), {"v_doppler_mps", "speed", "(messages: 80)"});
  unstamped.stamped = false;
  write_with_one(unstamped, of_other_field);
  expectError(run(), {"the stamp in the header is zero", "(messages: 80)"});

  what.imu_stamped = false;
  writeBag(what);
  sensor_msgs::Imu imu;
  imu.header.stamp = stamp;
  rosbag::Bag(bag_, rosbag::bagmode::Append).write("/sensor_platform/imu", record, imu);
  expectError(run(), {"/sensor_platform/imu: the stamp in the header is zero", "(messages: 1600)"});
}

TEST_F(BagRunnerErrors, TriggersWithAStampOfZeroAreNamed) {
  const auto writeTriggers = [&](int zero) {
    writeBag({});
    rosbag::Bag bag(bag_, rosbag::bagmode::Append);
    for (int k = 0; k < 80; ++k) {
      const ros::Time stamp = ros::Time(1000.0) + ros::Duration(0.1 * k);
      std_msgs::Header trigger;
      trigger.seq = static_cast<std::uint32_t>(k);
      if (k >= zero) trigger.stamp = stamp;
      bag.write("/sensor_platform/radar/trigger", stamp + ros::Duration(100.001), trigger);
    }
  };
  writeTriggers(80);
  expectError(
      run({"--set", "stamp_source=trigger"}),
      {"every one of the 80 scans was rejected: trigger_missing 80",
       "  1. 80 messages on trigger_topic /sensor_platform/radar/trigger have a stamp of zero, for 80 "
       "scans. Correct the driver"});
  writeTriggers(2);
  const Outcome outcome = run({"--set", "stamp_source=trigger"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("/sensor_platform/radar/trigger (trigger_topic): the stamp in the header is "
                             "zero"),
            std::string::npos)
      << outcome.err;
  EXPECT_NE(outcome.err.find("(messages: 2)"), std::string::npos) << outcome.err;
  const std::string yaml = contents(out_ + "/summary.yaml");
  EXPECT_NE(yaml.find("trigger_stamp_zero: 2"), std::string::npos) << yaml;
  EXPECT_NE(yaml.find("trigger_missing: 2"), std::string::npos) << yaml;
}

TEST_F(BagRunnerErrors, ABadMessageAmongGoodOnesIsCountedAndSaid) {
  writeBag({});
  {
    rosbag::Bag bag(bag_, rosbag::bagmode::Append);
    sensor_msgs::PointCloud2 empty;  // without a stamp
    bag.write("/sensor_platform/radar/scan", ros::Time(1005.0), empty);
    sensor_msgs::Imu unstamped;
    bag.write("/sensor_platform/imu", ros::Time(1005.0), unstamped);
  }
  const Outcome outcome = run();
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("/sensor_platform/radar/scan"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("/sensor_platform/imu: the stamp in the header is zero"), std::string::npos);
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 2) << outcome.err;
  const std::string yaml = contents(out_ + "/summary.yaml");
  EXPECT_NE(yaml.find("stamp_zero: 1"), std::string::npos) << yaml;
  EXPECT_NE(yaml.find("imu_not_usable: 1"), std::string::npos) << yaml;
  EXPECT_NE(yaml.find("scans_total: 81"), std::string::npos) << yaml;
}

TEST_F(BagRunnerErrors, NoDataInThePartPlayedIsNamed) {
  BagContents what;
  what.duration = 1.0;
  writeBag(what);
  {
    rosbag::Bag bag(bag_, rosbag::bagmode::Append);
    std_msgs::Header late;
    late.stamp = ros::Time(1200.0);
    bag.write("/other", ros::Time(1200.0), late);
  }
  expectError(run({"--set", "bag_start=50"}), {"no messages on topic /sensor_platform/imu"});
  expectError(run({"--set", "bag_start=1e300"}), {"bag_start (1e+300 s) is after its end ("});
}

TEST_F(BagRunnerErrors, NeverInitialisedSaysWhatItWaitedFor) {
  BagContents what;
  what.duration = 2.0;
  writeBag(what);
  expectError(run(), {"never initialised, waited for", "init_duration"});
  what.duration = 8.0;
  what.shaking = 1.0;
  writeBag(what);
  expectError(run({"--set", "init_mode=static"}), {"never initialised, waited for", "gyro"});
}

TEST_F(BagRunnerErrors, EveryScanRejectedSaysWhy) {
  BagContents what;
  what.points = 2;  // their Dopplers would count, see radar_factor
  writeBag(what);
  expectError(run({"--set", "radar_factor=velocity"}),
              {"every one of the 80 scans was rejected", "too_few_points"});
  EXPECT_FALSE(fs::exists(out_ + "/summary.yaml"));
  const std::string table = contents(out_ + "/ego_velocity.csv");  // says it for each
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 81);
  EXPECT_NE(table.find(",2,too_few_points\n"), std::string::npos) << table;
  what.points = 0;
  writeBag(what);
  expectError(run(), {"every one of the 80 scans was rejected", "too_few_points"});
}

TEST_F(BagRunnerErrors, ASummaryOfAnEarlierRunDoesNotOutliveAFailure) {
  writeBag({});
  ASSERT_EQ(run().status, 0);
  ASSERT_TRUE(fs::exists(out_ + "/summary.yaml"));
  BagContents what;
  what.points = 0;
  writeBag(what);
  EXPECT_EQ(run().status, 1);
  EXPECT_FALSE(fs::exists(out_ + "/summary.yaml"));
}

TEST_F(BagRunnerErrors, WrongParametersAndArgumentsAreNamed) {
  writeBag({});
  expectError(run({"--set", "widnow=1"}), {"widnow", "window"});
  expectError(run({"--set", "window=fast"}), {"window", "finite number"});
  expectError(runTool({bag_, "--config", "isr", "--output-dir", out_}), {"isr", "irs"});
  // Nothing was tried: another exit status.
  expectError(run({"--fast"}), {"unrecognised option '--fast'", "--help"}, 2);
  expectError(run({"--set"}), {"--set", "missing"}, 2);
  expectError(run({"--set", "window"}), {"--set window", "expected key=value"}, 2);
  expectError(run({"--config", "irs"}), {"config", "more than once"}, 2);
  expectError(run({"--bag="}), {"--bag"}, 2);
  expectError(run({bag_}), {"expected each bag once"}, 2);
  expectError(run({folder_ + "/./test.bag"}), {"expected each bag once"}, 2);
  expectError(runTool({"--config", "irs"}), {"missing argument BAG"}, 2);
  expectError(runTool({}), {"missing argument BAG --config"}, 2);
}

TEST_F(BagRunnerErrors, AGroundTruthIsNotOverwritten) {
  writeBag({});
  ASSERT_EQ(run().status, 0);
  const std::string truth = out_ + "/trajectory.txt", before = contents(truth);
  expectError(run({"--set", "ground_truth=" + truth}), {"ground_truth", truth, "expected another file"});
  EXPECT_EQ(contents(truth), before);
}

TEST_F(BagRunnerErrors, AnOutputFolderThatCannotBeIsNamed) {
  writeBag({});
  std::ofstream(folder_ + "/file") << "in the way";
  out_ = folder_ + "/file";
  expectError(run(), {"output folder", folder_ + "/file"});
  out_ = folder_ + "/file/below";
  expectError(run(), {"output folder", folder_ + "/file/below"});
  out_ = folder_ + "/" + std::string(300, 'x');
  expectError(run(), {"output folder " + out_ + ": cannot be made (File name too long)"});
}

TEST_F(BagRunnerErrors, AFullDiskIsNotBlamedOnTheBag) {
  BagContents what;
  what.duration = 30.0;  // more than the buffer of the trajectory holds
  writeBag(what);
  const FullDisk disk(100'000);
  expectError(run(), {"rio_t_bag: output " + out_ + "/trajectory.txt: writing failed"});
}

}  // namespace
}  // namespace rio_t
