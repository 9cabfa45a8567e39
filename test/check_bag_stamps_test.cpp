// check_bag on bags with stamps that are zero, of another clock, lost or there twice.
#include <gtest/gtest.h>
#include <ros/time.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/PointCloud2.h>

#include <algorithm>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "plain_bag.h"
#include "rio_t/ros/bag/check_bag.h"
#include "rio_t/ros/parameters/config.h"

namespace rio_t {
namespace {

using CheckBag = PlainBag;

TEST_F(CheckBag, ZeroStampsAreNamed) {
  Changes changes;
  changes.cloud = [](sensor_msgs::PointCloud2& cloud) {
    cloud.header.stamp = ros::Time();
    return true;
  };
  const BagCheck arrival = check(rewritten("zero", changes));
  expectLine(arrival, FindingLevel::kOdd, {"stamps", "are zero", "arrival"});
  EXPECT_EQ(configOf(arrival).stamp_source, StampSource::kArrival);
  expectRuns(arrival);
  changes.keep_triggers = true;
  const BagCheck trigger = check(rewritten("zero_with_triggers", changes));
  expectLine(trigger, FindingLevel::kOdd, {"stamps", "are zero", "/sensor_platform/radar/trigger"});
  EXPECT_EQ(configOf(trigger).stamp_source, StampSource::kTrigger);
  expectRuns(trigger);
}

TEST_F(CheckBag, ScansThatTheStampSourceOfTheUserDoesNotStampAreNamed) {
  Changes changes;
  const std::string bag = rewritten("no_triggers", changes);
  const std::vector<std::string> trigger = {"stamp_source=trigger",
                                            "trigger_topic=/sensor_platform/radar/trigger"};
  const BagCheck none = check(bag, false, trigger);
  expectLine(none, FindingLevel::kMissing, {"radar", "no scan gets a stamp", "stamp_source: trigger"});
  EXPECT_NE(none.to_do.find("stamp_source"), std::string::npos) << none.to_do;
  // One trigger without a stamp among good ones does no harm.
  const std::string path = folder_ + "/zero_trigger.bag";
  {
    const rosbag::Bag in(bag_);
    rosbag::Bag out(path, rosbag::bagmode::Write);
    rosbag::View view(in);
    int triggers = 0;
    for (const rosbag::MessageInstance& instance : view) {
      const auto header = instance.instantiate<std_msgs::Header>();
      if (header && ++triggers == 100) header->stamp = ros::Time();
      if (header) {
        out.write(instance.getTopic(), instance.getTime(), *header);
      } else {
        out.write(instance.getTopic(), instance.getTime(), instance);
      }
    }
  }
  EXPECT_TRUE(check(path, false, trigger).ready());
}

TEST_F(CheckBag, StampsOfAnotherClockAreNamed) {
  Changes changes;
  changes.cloud = [](sensor_msgs::PointCloud2& cloud) {
    cloud.header.stamp -= ros::Duration(5000.0);
    return true;
  };
  const BagCheck odd = check(rewritten("clock", changes));
  expectLine(odd, FindingLevel::kOdd, {"stamps", "another clock", "behind"});
  expectRuns(odd);
}

/// The offset estimate does not reach so far.
TEST_F(CheckBag, StampsFarAheadOfTheirArrivalAreNotUsed) {
  Changes changes;
  changes.cloud = [](sensor_msgs::PointCloud2& cloud) {
    cloud.header.stamp += ros::Duration(0.9);
    return true;
  };
  const std::string bag = rewritten("ahead", changes);
  const BagCheck odd = check(bag);
  expectLine(odd, FindingLevel::kOdd, {"stamps", "ahead of their arrival", "stamp_source: arrival is used"});
  EXPECT_EQ(configOf(odd).stamp_source, StampSource::kArrival);
  EXPECT_LT(turnFromTruth(odd), 5.0);
  expectRuns(odd);
  // check_bag also looks at the bag with the keys that the user tells.
  for (const char* told : {"stamp_source=arrival", "radar_stamp_shift=-0.9"}) {
    const BagCheck by_told = check(bag, true, {told});
    EXPECT_LT(turnFromTruth(by_told), 5.0) << told;
    expectRuns(by_told);
  }
}

TEST_F(CheckBag, ScansThatComeLateAreNamed) {
  Changes changes;
  changes.cloud = [](sensor_msgs::PointCloud2& cloud) {
    cloud.header.stamp -= ros::Duration(0.5);
    return true;
  };
  expectLine(check(rewritten("late", changes), false), FindingLevel::kOdd,
             {"stamps", "after their stamps", "--set stamp_source=arrival"});
}

TEST_F(CheckBag, AnOffsetNearItsBoundIsOddAndNamesTheKey) {
  const double offset = setup_.time_offset.constant;
  const auto with = [&](const std::string& name, double seconds) {
    setup_.time_offset.constant = seconds;
    const std::string path = folder_ + "/offset_" + name + ".bag";
    write("medium", 50.0, BagFormat::kIrs, path);
    setup_.time_offset.constant = offset;
    return path;
  };
  for (const auto& [name, sign] : {std::make_pair("late", 1.0), std::make_pair("early", -1.0)})
    expectLine(check(with(name, 0.4 * sign), false), FindingLevel::kOdd,
               {"offset", "ms or beyond: check_bag searches no farther", "max_time_offset 0.25 s",
                "radar_stamp_shift"});
  const std::string near = with("near", 0.22);
  expectLine(check(near, false), FindingLevel::kOdd, {"offset", "near or beyond max_time_offset"});
  const BagCheck wide = check(near, false, {"max_time_offset=0.6"});
  expectLine(wide, FindingLevel::kOk, {"offset", "roughly"});
  EXPECT_NEAR(configOf(wide).odometry.radar.time_offset_initial, 0.22, 0.015);
  const BagCheck narrow = check(near, false, {"max_time_offset=0.1"});
  EXPECT_NEAR(configOf(narrow).odometry.radar.time_offset_initial, 0.08, 1e-9) << "the largest that is safe";
}

TEST_F(CheckBag, RadarsOfOneClockGetOneOffset) {
  const simulation::SimulationOptions plain = setup_;
  const std::string path = folder_ + "/one_clock.bag", other = folder_ + "/one_clock_right.bag";
  setup_.time_offset.constant = 0.12;
  write("medium", 50.0, BagFormat::kIrs, path);
  setup_.time_offset.constant = 0.09;
  setup_.T_IR.q_IR = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()) * setup_.T_IR.q_IR;
  write("medium", 50.0, BagFormat::kIrs, other);
  setup_ = plain;
  {
    rosbag::Bag both(path, rosbag::bagmode::Append);
    const rosbag::Bag right(other);
    rosbag::View view(right, rosbag::TypeQuery("sensor_msgs/PointCloud2"));
    for (const rosbag::MessageInstance& instance : view) both.write("/right", instance.getTime(), instance);
  }
  const Config apart = configOf(check(path, false));
  ASSERT_EQ(apart.radars.size(), 2u);
  EXPECT_NE(apart.odometry.radars[0].time_offset_initial, apart.odometry.radars[1].time_offset_initial);
  const Config shared = configOf(check(path, false, {"time_offset_shared=true"}));
  ASSERT_EQ(shared.radars.size(), 2u);
  EXPECT_EQ(shared.odometry.radars[0].time_offset_initial, shared.odometry.radars[1].time_offset_initial);
  EXPECT_NEAR(shared.odometry.radars[0].time_offset_initial, 0.105, 0.03);
}

TEST_F(CheckBag, AClockThatJumpsBackHalfwayIsNamed) {
  Changes changes;
  changes.cloud = [count = 0](sensor_msgs::PointCloud2& cloud) mutable {
    if (++count > 300) cloud.header.stamp -= ros::Duration(10.0);
    return true;
  };
  expectLine(check(rewritten("jump", changes)), FindingLevel::kOdd,
             {"stamps", "after their stamps", "clock of the radar"});
}

TEST_F(CheckBag, AnImuSampleWithAWrongStampIsLeftOutAlone) {
  int count = 0;
  const BagCheck ahead = check(rewritten("imu_ahead", {[&](sensor_msgs::Imu& imu) {
                                           if (++count == 8000) imu.header.stamp += ros::Duration(100.0);
                                           return true;
                                         }}));
  expectLine(ahead, FindingLevel::kOdd, {"IMU stamps", "leaves out 1 of", "1 stamped more than 0.5 s ahead"});
  expectLine(ahead, FindingLevel::kOk, {"stamps in the header"});
  EXPECT_EQ(configOf(ahead).stamp_source, StampSource::kHeader);
  EXPECT_EQ(ahead.yaml.find("init_mode"), std::string::npos) << ahead.yaml;
  expectRuns(ahead);
  EXPECT_LT(turnFromTruth(ahead), 5.0);
  count = 0;
  const BagCheck zero = check(rewritten("imu_zero_once", {[&](sensor_msgs::Imu& imu) {
                                          if (++count == 8000) imu.header.stamp = ros::Time();
                                          return true;
                                        }}),
                              false);
  EXPECT_TRUE(zero.ready());
  expectLine(zero, FindingLevel::kOdd, {"IMU stamps", "leaves out 1 of", "1 with a stamp of zero"});
}

TEST_F(CheckBag, ImuSamplesOfAnotherClockAreLeftOut) {
  const ros::Duration uptime(1000.0);
  int count = 0;
  const BagCheck synced = check(rewritten("imu_synced", {[&](sensor_msgs::Imu& imu) {
                                            if (++count <= 200) imu.header.stamp -= uptime;
                                            return true;
                                          }}));
  expectLine(synced, FindingLevel::kOdd, {"IMU stamps", "leaves out", "the clock jumped"});
  EXPECT_EQ(configOf(synced).stamp_source, StampSource::kHeader);
  expectRuns(synced);
  EXPECT_LT(turnFromTruth(synced), 5.0);
  // A jump near the end costs the end, not all before it.
  count = 0;
  const BagCheck late = check(rewritten("imu_late_jump", {[&](sensor_msgs::Imu& imu) {
                                          if (++count > 18000) imu.header.stamp += uptime;
                                          return true;
                                        }}),
                              false);
  expectLine(late, FindingLevel::kOdd, {"IMU stamps", "the clock jumped"});
  expectLine(late, FindingLevel::kOk, {"rest", "at rest from"});
  EXPECT_LT(turnFromTruth(late), 5.0);
}

TEST_F(CheckBag, APauseOfTheImuIsNoJumpOfItsClock) {
  int count = 0;
  const BagCheck odd = check(rewritten("imu_pause", {[&](sensor_msgs::Imu&) {
                                         ++count;
                                         return count < 8000 || 10000 < count;
                                       }}),
                             false);
  expectLine(odd, FindingLevel::kOdd, {"IMU", "gaps: 1"});
  for (const Finding& finding : odd.findings) EXPECT_NE(finding.subject, "IMU stamps") << describeCheck(odd);
  EXPECT_LT(turnFromTruth(odd), 5.0);
}

/// The driver reads twenty samples at once, and stamps them then.
TEST_F(CheckBag, StampsInBurstsAreNamedAndNoGaps) {
  std::vector<ros::Time> stamps;
  rewritten("stamps", {[&](sensor_msgs::Imu& imu) {
              stamps.push_back(imu.header.stamp);
              return true;
            }});
  for (const std::size_t size : {8, 20}) {
    std::size_t count = 0;
    Changes changes;
    changes.imu = [&](sensor_msgs::Imu& imu) {
      const std::size_t k = count++, last = std::min(stamps.size() - 1, k / size * size + size - 1);
      imu.header.stamp = stamps[last] - ros::Duration(5e-5 * static_cast<double>(last - k));
      return true;
    };
    const BagCheck odd = check(rewritten("bursts_" + std::to_string(size), changes));
    const std::string text = describeCheck(odd);
    expectLine(
        odd, FindingLevel::kOdd,
        {"IMU", "/sensor_platform/imu: 409 Hz: the stamps come in bursts of " + std::to_string(size) + ",",
         "No sample is lost"});
    EXPECT_EQ(text.find("gaps"), std::string::npos) << text;
    EXPECT_EQ(text.find("loses"), std::string::npos) << text;
  }
}

TEST_F(CheckBag, ABagRecordedTwiceIsReady) {
  Changes changes;
  changes.copies = 2;
  changes.keep_triggers = true;
  const std::string bag = rewritten("twice", changes);
  const BagCheck odd = check(bag);
  ASSERT_TRUE(odd.ready()) << describeCheck(odd);
  EXPECT_EQ(odd.to_do, "") << describeCheck(odd);
  expectLine(odd, FindingLevel::kOk, {"trial run", "no divergence"});
  expectLine(odd, FindingLevel::kOdd, {"/sensor_platform/imu", "duplicate stamps"});
  expectLine(odd, FindingLevel::kOk, {"/sensor_platform/radar/scan", "duplicate stamps"});
  // A copy has another arrival, and no trigger of its own.
  const std::string trigger = "trigger_topic=/sensor_platform/radar/trigger";
  expectLine(check(bag, true, {"stamp_source=arrival"}), FindingLevel::kOk, {"trial run", "100 %"});
  expectLine(check(bag, true, {"stamp_source=trigger", trigger}), FindingLevel::kOk, {"trial run", "100 %"});
}

/// A driver publishes what it filters, too. At rest nothing shows that it is not another radar.
TEST_F(CheckBag, TwoTopicsOfOneRadarAreOne) {
  const auto with_filtered = [](const std::string& name, double seconds) {
    std::string path = folder_ + "/" + name + ".bag";
    const rosbag::Bag in(bag_);
    rosbag::Bag out(path, rosbag::bagmode::Write);
    rosbag::View view(in);
    const ros::Time end = view.getBeginTime() + ros::Duration(seconds);
    for (const rosbag::MessageInstance& instance : view) {
      if (instance.getTime() > end) break;
      out.write(instance.getTopic(), instance.getTime(), instance);
      if (instance.isType<sensor_msgs::PointCloud2>()) out.write("/filtered", instance.getTime(), instance);
    }
    return path;
  };
  expectLine(check(with_filtered("filtered", 50.0), false), FindingLevel::kOdd,
             {"has the stamps and the mounting of", "one radar"});
  expectLine(check(with_filtered("filtered_at_rest", 4.5), false), FindingLevel::kOdd,
             {"has the stamps of", "If these are two radars, record with motion"});
}

// A driver that gives two scans one stamp: half of them are lost, and that is no matter of the recorder.
TEST_F(CheckBag, TwoScansOfOneStampAreNoCopies) {
  ros::Time last;
  bool again = false;
  Changes changes;
  changes.cloud = [&](sensor_msgs::PointCloud2& cloud) {
    if (again) cloud.header.stamp = last;
    last = cloud.header.stamp;
    again = !again;
    return true;
  };
  const BagCheck odd = check(rewritten("one_stamp", changes));
  for (const Finding& finding : odd.findings) {
    if (finding.subject != "trial run") continue;
    EXPECT_EQ(finding.text.find("100 %"), std::string::npos) << finding.text;
  }
}

/// The header stamps are those of one clock. Only the clock of the recorder, or of a converter, runs oddly.
TEST_F(CheckBag, AnOddClockOfTheRecordsIsNotThatOfTheRadar) {
  const auto rerecorded = [](const std::string& name, const std::function<double(double)>& secondsOf) {
    std::string path = folder_ + "/" + name + ".bag";
    const rosbag::Bag in(bag_);
    rosbag::Bag out(path, rosbag::bagmode::Write);
    rosbag::View view(in);
    const ros::Time begin = view.getBeginTime();
    for (const rosbag::MessageInstance& instance : view)
      out.write(instance.getTopic(), begin + ros::Duration(secondsOf((instance.getTime() - begin).toSec())),
                instance);
    return path;
  };
  const std::map<std::string, std::function<double(double)>> clocks = {
      {"steps", [](double t) { return t < 20.0 ? t : t + 3.0; }},
      {"is_fast", [](double t) { return 1.1 * t; }},
      {"of_a_converter", [](double t) { return 0.05 * t; }}};
  for (const auto& [name, secondsOf] : clocks) {
    const BagCheck odd = check(rerecorded("record_clock_" + name, secondsOf), false);
    EXPECT_EQ(configOf(odd).stamp_source, StampSource::kHeader) << name << "\n" << describeCheck(odd);
    EXPECT_LT(turnFromTruth(odd), 5.0) << name;
  }
}

TEST_F(CheckBag, TopicsThatWereWrittenOneAfterTheOtherAreNamed) {
  const std::string path = folder_ + "/one_after_the_other.bag";
  {
    const rosbag::Bag in(bag_);
    rosbag::Bag out(path, rosbag::bagmode::Write);
    ros::Time record(1000.0);
    for (const char* type : {"sensor_msgs/Imu", "sensor_msgs/PointCloud2"}) {
      rosbag::View view(in, rosbag::TypeQuery(type));
      for (const rosbag::MessageInstance& instance : view)
        out.write(instance.getTopic(), record += ros::Duration(1e-4), instance);
    }
  }
  const BagCheck odd = check(path, false);
  expectLine(odd, FindingLevel::kOdd, {"stamps", "one after the other", "record time"});
  EXPECT_EQ(configOf(odd).stamp_source, StampSource::kHeader);
}

TEST_F(CheckBag, ATriggerThatIsAsFarAheadAsTheScansIsNotChosen) {
  const std::string path = folder_ + "/ahead.bag";
  {
    const rosbag::Bag in(bag_);
    rosbag::Bag out(path, rosbag::bagmode::Write);
    rosbag::View view(in);
    for (const rosbag::MessageInstance& instance : view) {
      const ros::Duration ahead(0.5);
      if (const auto cloud = instance.instantiate<sensor_msgs::PointCloud2>()) {
        cloud->header.stamp += ahead;
        out.write(instance.getTopic(), instance.getTime(), *cloud);
      } else if (const auto trigger = instance.instantiate<std_msgs::Header>()) {
        trigger->stamp += ahead;
        out.write(instance.getTopic(), instance.getTime(), *trigger);
      } else {
        out.write(instance.getTopic(), instance.getTime(), instance);
      }
    }
  }
  EXPECT_EQ(configOf(check(path, false)).stamp_source, StampSource::kArrival);
}

}  // namespace
}  // namespace rio_t
