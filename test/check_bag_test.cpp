// check_bag on simulated bags: as they are, with topics of other sensors, and without what it needs.
#include "rio_t/ros/bag/check_bag.h"

#include <geometry_msgs/Vector3.h>
#include <gtest/gtest.h>
#include <ros/time.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/point_cloud2_iterator.h>
#include <std_msgs/Header.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>

#include "../src/ros/bag/inspect_recording.h"
#include "plain_bag.h"
#include "rio_t/core/angle.h"
#include "rio_t/radar/mounting.h"
#include "rio_t/ros/bag/bag_runner.h"
#include "rio_t/ros/bag/simulation_bag.h"
#include "rio_t/ros/parameters/parameters.h"
#include "rio_t/simulation/motions.h"
#include "rio_t/simulation/presets.h"
#include "rio_t/simulation/simulation.h"

namespace rio_t {
namespace {

class CheckBag : public PlainBag {
 protected:
  /// The plain bag with messages of another sensor, `rate` [Hz] of them.
  template <typename Message>
  static std::string withTopic(const std::string& name, const std::string& topic, double rate,
                               Message message) {
    std::string path = rewritten(name, {});
    const rosbag::Bag plain(bag_);
    rosbag::View view(plain);
    const ros::Time begin = view.getBeginTime(), end = view.getEndTime();
    rosbag::Bag bag(path, rosbag::bagmode::Append);
    for (ros::Time time = begin; time < end; time += ros::Duration(1.0 / rate)) {
      message.header.stamp = time;
      bag.write(topic, time, message);
    }
    return path;
  }
};

TEST_F(CheckBag, APlainBagIsReadyAndItsMountingIsFound) {
  const BagCheck plain = check(bag_);
  expectRuns(plain);
  EXPECT_LT(turnFromTruth(plain), 5.0);
  EXPECT_EQ(std::count_if(plain.findings.begin(), plain.findings.end(),
                          [](const Finding& f) { return f.level != FindingLevel::kOk; }),
            0)
      << describeCheck(plain);
  expectLine(plain, FindingLevel::kOk, {"radar", "/sensor_platform/radar/scan", "format irs"});
  expectLine(plain, FindingLevel::kOk, {"rest", "gravity 9.", "up is +z"});
  expectLine(plain, FindingLevel::kOk, {"Doppler", "positive for receding", "the IMU"});
  // Only what differs from the defaults.
  for (const char* key : {"radar_format", "stamp_source", "radar_doppler_sign", "imu_rate_unit", "init_mode"})
    EXPECT_EQ(plain.yaml.find(std::string("\n") + key), std::string::npos) << plain.yaml;
}

TEST_F(CheckBag, AGyroBesideTheImuIsNotTakenForIt) {
  sensor_msgs::Imu gyro;
  gyro.angular_velocity.z = 0.01;
  const std::string bag = withTopic("gyro", "/camera/gyro/sample", 833.0, gyro);
  const BagCheck odd = check(bag);
  expectLine(odd, FindingLevel::kOdd,
             {"/sensor_platform/imu is chosen", "/camera/gyro/sample (cannot be used)", "--imu-topic"});
  EXPECT_EQ(configOf(odd).imu_topic, "/sensor_platform/imu");
  expectRuns(odd);
  CheckRequest request;
  request.imu_topic = "/camera/gyro/sample";
  const BagCheck asked = checkBag({bag}, request);
  expectLine(asked, FindingLevel::kMissing, {"gravity is missing"});
}

TEST_F(CheckBag, ABagWithoutImuIsMissingOne) {
  const BagCheck odd = check(rewritten("no_imu", {[](sensor_msgs::Imu&) { return false; }}));
  expectLine(odd, FindingLevel::kMissing, {"IMU", "no topic of type sensor_msgs/Imu"});
  EXPECT_FALSE(odd.ready());
  EXPECT_NE(odd.to_do.find("Record the IMU"), std::string::npos);
}

TEST_F(CheckBag, AnImuWithoutStampsOrGravityIsMissingThem) {
  const BagCheck stamps = check(rewritten("imu_zero", {[](sensor_msgs::Imu& imu) {
                                            imu.header.stamp = ros::Time();
                                            return true;
                                          }}));
  expectLine(stamps, FindingLevel::kMissing, {"IMU stamps", "are zero"});
  EXPECT_FALSE(stamps.ready());
  // The IMU is not level: what it shows at rest is its gravity.
  std::optional<geometry_msgs::Vector3> gravity_I;
  const BagCheck gravity = check(rewritten("no_gravity", {[&](sensor_msgs::Imu& imu) {
                                             geometry_msgs::Vector3& force = imu.linear_acceleration;
                                             if (!gravity_I) gravity_I = force;
                                             force.x -= gravity_I->x;
                                             force.y -= gravity_I->y;
                                             force.z -= gravity_I->z;
                                             return true;
                                           }}));
  expectLine(gravity, FindingLevel::kMissing, {"gravity is missing"});
  EXPECT_FALSE(gravity.ready());
}

TEST_F(CheckBag, AnImuThatIsNotFiniteIsNotUsed) {
  int count = 0;
  const BagCheck odd = check(rewritten("imu_nan", {[&](sensor_msgs::Imu& imu) {
                                         if (++count % 5 == 0) imu.angular_velocity.x = std::nan("");
                                         return true;
                                       }}));
  expectLine(odd, FindingLevel::kMissing, {"IMU", "samples are not finite"});
  EXPECT_FALSE(odd.ready());
  EXPECT_NE(odd.to_do.find("NaN"), std::string::npos);
}

TEST_F(CheckBag, AnImuThatIsPolledTooOftenIsNamed) {
  std::optional<sensor_msgs::Imu> last;
  int count = 0;
  const BagCheck odd = check(rewritten("imu_twice", {[&](sensor_msgs::Imu& imu) {
                                         if (++count % 2 == 0) {
                                           imu.angular_velocity = last->angular_velocity;
                                           imu.linear_acceleration = last->linear_acceleration;
                                         }
                                         last = imu;
                                         return true;
                                       }}));
  expectLine(odd, FindingLevel::kOdd, {"repeats", "samples have the values of the one before"});
  EXPECT_TRUE(odd.ready());
}

TEST_F(CheckBag, ADopplerThatIsNotFiniteIsNamed) {
  Changes changes;
  changes.cloud = [](sensor_msgs::PointCloud2& cloud) {
    if (cloud.width == 0) return true;
    sensor_msgs::PointCloud2Iterator<float> doppler(cloud, "v_doppler_mps");
    for (; doppler != doppler.end(); ++doppler) *doppler = std::nanf("");
    return true;
  };
  const BagCheck odd = check(rewritten("doppler_nan", changes));
  expectLine(odd, FindingLevel::kMissing, {"radar", "v_doppler_mps is not finite in every point"});
  EXPECT_FALSE(odd.ready());
}

TEST_F(CheckBag, PointsThatAreNotFiniteAreNamed) {
  int points = 0;
  Changes changes;
  changes.cloud = [&](sensor_msgs::PointCloud2& cloud) {
    sensor_msgs::PointCloud2Iterator<float> doppler(cloud, "v_doppler_mps");
    for (; doppler != doppler.end(); ++doppler)
      if (++points % 5 == 0) *doppler = std::nanf("");
    return true;
  };
  const BagCheck odd = check(rewritten("some_nan", changes));
  expectLine(odd, FindingLevel::kOdd,
             {"points", "20 % have a position, a Doppler or a power that is not finite"});
  EXPECT_TRUE(odd.ready());
}

TEST_F(CheckBag, ManyEmptyCloudsAreOdd) {
  int clouds = 0;
  Changes changes;
  changes.cloud = [&](sensor_msgs::PointCloud2& cloud) {
    if (++clouds % 5 < 2) sensor_msgs::PointCloud2Modifier(cloud).resize(0);
    return true;
  };
  expectLine(check(rewritten("often_empty", changes), false), FindingLevel::kOdd,
             {"points", "0 /", "40 % of the clouds are empty"});
}

// Some drivers send clouds of one size, filled up with zeros.
TEST_F(CheckBag, PointsAtRangeZeroAreNone) {
  Changes changes;
  changes.cloud = [](sensor_msgs::PointCloud2& cloud) {
    sensor_msgs::PointCloud2Modifier modifier(cloud);
    modifier.resize(modifier.size() + 64);
    return true;
  };
  const auto textOf = [](const BagCheck& check) {
    const auto found = std::find_if(check.findings.begin(), check.findings.end(),
                                    [](const Finding& finding) { return finding.subject == "points"; });
    return found == check.findings.end() ? std::string() : found->text;
  };
  const std::string text = textOf(check(bag_, false));
  EXPECT_FALSE(text.empty());
  EXPECT_EQ(textOf(check(rewritten("filled_up", changes), false)), text);
}

TEST_F(CheckBag, ScansBeforeTheStartAreNotMissed) {
  const BagCheck plain = check(bag_);
  const RunSummary summary = run(plain);
  std::uint64_t before = 0;
  for (const RadarSummary& radar : summary.radars) before += radar.scans_before_start;
  ASSERT_GT(before, 0u);
  const double share =
      100.0 * static_cast<double>(summary.scansUsed()) / static_cast<double>(summary.scansTotal() - before);
  expectLine(plain, FindingLevel::kOk,
             {"trial run", std::to_string(std::lround(share)) + " % of the scans after the start used"});
}

TEST_F(CheckBag, ACloudWithoutDopplerIsNamedWithItsFields) {
  Changes changes;
  changes.cloud = [](sensor_msgs::PointCloud2& cloud) {
    for (sensor_msgs::PointField& field : cloud.fields) {
      if (field.name == "v_doppler_mps") field.name = "label";
    }
    return true;
  };
  const BagCheck odd = check(rewritten("no_doppler", changes));
  expectLine(odd, FindingLevel::kMissing, {"no field name looks like a Doppler", "snr_db, label"});
  EXPECT_FALSE(odd.ready());
}

/// Two nodes publish the IMU, by turns: whatever else is said misleads.
TEST_F(CheckBag, SeveralPublishersOfOneTopicAreNamed) {
  const std::string path = folder_ + "/two_publishers.bag";
  {
    const rosbag::Bag in(bag_);
    rosbag::Bag out(path, rosbag::bagmode::Write);
    rosbag::View view(in);
    const auto header_of = [](const std::string& caller) {
      const auto header = boost::make_shared<ros::M_string>();
      (*header)["callerid"] = caller;
      (*header)["type"] = ros::message_traits::DataType<sensor_msgs::Imu>::value();
      (*header)["md5sum"] = ros::message_traits::MD5Sum<sensor_msgs::Imu>::value();
      (*header)["message_definition"] = ros::message_traits::Definition<sensor_msgs::Imu>::value();
      return header;
    };
    const auto one = header_of("/driver"), other = header_of("/camera");
    int clouds = 0;
    for (const rosbag::MessageInstance& instance : view) {
      const std::string& topic = instance.getTopic();
      if (const auto imu = instance.instantiate<sensor_msgs::Imu>()) {
        imu->header.frame_id = "imu";
        out.write(topic, instance.getTime(), *imu, one);
        std::swap(imu->linear_acceleration.y, imu->linear_acceleration.z);
        imu->header.frame_id = "camera_imu";
        imu->header.stamp += ros::Duration(5e-4);
        out.write(topic, instance.getTime(), *imu, other);
      } else if (const auto cloud = instance.instantiate<sensor_msgs::PointCloud2>()) {
        cloud->header.frame_id = ++clouds % 2 == 0 ? "front" : "rear";
        out.write(topic, instance.getTime(), *cloud);
      }
    }
  }
  const BagCheck odd = check(path);
  const std::string imu =
      "Topic /sensor_platform/imu has messages of 2 publishers by turns: /camera (frame_id \"camera_imu\") "
      "and "
      "/driver (frame_id \"imu\").";
  const std::string radar = "Topic /sensor_platform/radar/scan has messages of 2 frame_ids by turns";
  expectLine(odd, FindingLevel::kOdd, {"IMU", imu, "remap"});
  expectLine(odd, FindingLevel::kOdd, {"radar", radar, "\"front\" and \"rear\"", "remap"});
  EXPECT_EQ(odd.findings.front().text.find(imu), 0U) << describeCheck(odd);
  // The run says it first, too.
  BagRun bag_run;
  bag_run.bags = {path};
  Diagnosis diagnosis;
  try {
    diagnosis = runBag(bag_run).diagnosis;
  } catch (const RunFailed& failed) {
    diagnosis = failed.diagnosis();
  }
  EXPECT_NE(describeCauses(diagnosis).find("1. " + imu), std::string::npos) << describeCauses(diagnosis);
  EXPECT_NE(describeCauses(diagnosis).find("2. " + radar), std::string::npos) << describeCauses(diagnosis);
}

/// A node that starts again under another name publishes alone.
TEST(Publishers, ComeByTurns) {
  Publishers one, restarted, two;
  for (int k = 0; k < 100; ++k) {
    one.add("/a", "imu");
    restarted.add(k < 50 ? "/a_1" : "/a_2", "imu");
    two.add("/a", k % 10 == 0 ? "radar" : "imu");
  }
  one.add("/b", "imu");
  EXPECT_EQ(one.describeSeveral("/imu"), "");
  EXPECT_EQ(restarted.describeSeveral("/imu"), "");
  EXPECT_EQ(two.describeSeveral("/imu").find("Topic /imu has messages of 2 frame_ids"), 0U);
}

sensor_msgs::PointCloud2 lidarCloud() {
  sensor_msgs::PointCloud2 cloud;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  modifier.setPointCloud2FieldsByString(1, "xyz");
  modifier.resize(100);
  return cloud;
}

TEST_F(CheckBag, CloudsOfALidarAreNotKeptButNamed) {
  const std::string bag = withTopic("lidar", "/lidar/points", 10.0, lidarCloud());
  const Recording recording = readRecording({bag}, {});
  ASSERT_EQ(recording.clouds.size(), 2u);
  for (const CloudTopic& topic : recording.clouds) {
    if (topic.topic == "/lidar/points") {
      EXPECT_EQ(topic.messages.size(), 1u);
    } else {
      EXPECT_GT(topic.messages.size(), 400u) << topic.topic;
    }
    EXPECT_EQ(topic.times.size(), topic.messages.size()) << topic.topic;
  }
  const BagCheck odd = check(bag, false);
  EXPECT_TRUE(odd.ready());
  expectLine(odd, FindingLevel::kOdd, {"/lidar/points", "no field name looks like a Doppler", "x, y, z"});
}

TEST_F(CheckBag, OnlyTopicsThatAreAskedForAreRead) {
  CheckRequest request;
  request.imu_topic = "/sensor_platform/imu";
  request.radar_topics = {"/sensor_platform/radar/scan"};
  const Recording lidar =
      readRecording({withTopic("asked_lidar", "/lidar/points", 10.0, lidarCloud())}, request);
  ASSERT_EQ(lidar.clouds.size(), 1u);
  EXPECT_EQ(lidar.clouds.front().topic, request.radar_topics.front());
  const Recording imus =
      readRecording({withTopic("asked_imu", "/camera/imu", 200.0, sensor_msgs::Imu())}, request);
  ASSERT_EQ(imus.imus.size(), 1u);
  EXPECT_EQ(imus.imus.front().topic, request.imu_topic);
}

TEST_F(CheckBag, ATopicMayBeRelative) {
  CheckRequest request;
  request.imu_topic = "sensor_platform/imu";
  request.radar_topics = {"sensor_platform/radar/scan"};
  const Recording recording = readRecording({bag_}, request);
  EXPECT_EQ(recording.imus.size(), 1u);
  EXPECT_EQ(recording.clouds.size(), 1u);
}

TEST_F(CheckBag, ATopicThatIsNotThereIsToBeChosenAnew) {
  CheckRequest request;
  request.imu_topic = "/imu";
  const BagCheck imu = checkBag({bag_}, request);
  expectLine(imu, FindingLevel::kMissing, {"no topic /imu", "/sensor_platform/imu (sensor_msgs/Imu)"});
  EXPECT_NE(imu.to_do.find("with --imu-topic"), std::string::npos) << imu.to_do;
  request.imu_topic = "";
  request.radar_topics = {"/scan"};
  const BagCheck radar = checkBag({bag_}, request);
  expectLine(radar, FindingLevel::kMissing, {"no topic /scan", "/sensor_platform/radar/scan"});
  EXPECT_NE(radar.to_do.find("with --radar-topic"), std::string::npos) << radar.to_do;
  // Beside one that is there, too: the bag runs without it, but that is not what was asked for.
  request.radar_topics = {"/sensor_platform/radar/scan", "/typo"};
  request.try_out = false;
  const BagCheck both = checkBag({bag_}, request);
  EXPECT_TRUE(both.ready());
  expectLine(both, FindingLevel::kMissing, {"no topic /typo", "/sensor_platform/radar/scan"});
  EXPECT_NE(both.to_do.find("with --radar-topic"), std::string::npos) << both.to_do;
}

TEST_F(CheckBag, TheOtherFormatOfTheSimulatorIsReady) {
  const std::string path = folder_ + "/ti.bag";
  write("medium", 50.0, BagFormat::kTiMmwave, path);
  const BagCheck ti = check(path);
  expectRuns(ti);
  EXPECT_EQ(configOf(ti).stamp_source, StampSource::kTrigger);
  EXPECT_LT(turnFromTruth(ti), 5.0);
}

TEST_F(CheckBag, TwoRadarsGetASectionEach) {
  simulation::Preset kart = simulation::presetOf("kart_pair");
  kart.options.seed = 2;
  simulation::MotionRequest request;
  request.name = kart.motion;
  request.seed = 2;
  request.duration = 60.0;
  request.rest = kart.rest;
  const simulation::Motion motion = simulation::makeMotion(request);
  const std::string path = folder_ + "/pair.bag";
  writeSimulationBag(path, motion, simulation::simulate(motion, kart.options), kart.options.start, {});
  const BagCheck pair = check(path);
  expectRuns(pair);
  const auto is_odd_mounting = [](const Finding& finding) {
    return finding.level == FindingLevel::kOdd &&
           finding.text.find("compare it with the robot") != std::string::npos;
  };
  EXPECT_EQ(std::count_if(pair.findings.begin(), pair.findings.end(), is_odd_mounting), 2)
      << "six points a scan";
  const Config config = configOf(pair);
  ASSERT_EQ(config.radars.size(), 2u) << pair.yaml;
  for (const Config& radar : config.radars) {
    const Extrinsics& truth = kart.options.radars.at(radar.radar_name).T_IR;
    EXPECT_LT(radar.odometry.radar.T_IR.q_IR.angularDistance(truth.q_IR) / kDegree, 15.0) << radar.radar_name;
  }
  // A topic that says nothing gets the first name that is free.
  const std::string renamed = folder_ + "/renamed.bag";
  {
    const rosbag::Bag in(path);
    rosbag::Bag out(renamed, rosbag::bagmode::Write);
    rosbag::View view(in);
    for (const rosbag::MessageInstance& instance : view) {
      const std::string& topic = instance.getTopic();
      out.write(topic == "/sensor_platform/radar_right/scan"  ? "/radar2/scan"
                : topic == "/sensor_platform/radar_left/scan" ? "/scan"
                                                              : topic,
                instance.getTime(), instance);
    }
  }
  const Config other = configOf(check(renamed, false));
  ASSERT_EQ(other.radars.size(), 2u);
  EXPECT_EQ(other.radars[0].radar_name, "radar2");
  EXPECT_EQ(other.radars[1].radar_name, "radar1");
}

TEST_F(CheckBag, ATrialRunThatIsBadSaysWhy) {
  int clouds = 0;
  Changes changes;
  changes.cloud = [&](sensor_msgs::PointCloud2&) { return ++clouds <= 200; };
  const std::string bag = rewritten("silent", changes);
  const BagCheck odd = check(bag);
  expectLine(odd, FindingLevel::kOdd, {"trial run", "the run is bad: No scan was used from"});
  EXPECT_NE(odd.to_do, "");
  EXPECT_EQ(odd.to_do.find("mounting"), std::string::npos) << odd.to_do;
  CheckRequest request;
  request.bags = {bag};
  std::ostringstream out;
  EXPECT_EQ(runCheck(request, out), 1) << out.str();
}

/// Nothing shows the mounting: what is written is a guess, and a script must not take it for ready.
TEST_F(CheckBag, ABagAtRestIsNotReady) {
  std::optional<ros::Time> begin;
  const auto at_rest = [&](const std_msgs::Header& header) {
    if (!begin) begin = header.stamp;
    return header.stamp < *begin + ros::Duration(4.5);
  };
  Changes changes;
  changes.imu = [&](sensor_msgs::Imu& imu) { return at_rest(imu.header); };
  changes.cloud = [&](sensor_msgs::PointCloud2& cloud) { return at_rest(cloud.header); };
  CheckRequest request;
  request.bags = {rewritten("rest", changes)};
  std::ostringstream out;
  EXPECT_EQ(runCheck(request, out), 1) << out.str();
  EXPECT_NE(out.str().find("The mounting is a guess"), std::string::npos) << out.str();
  request.set = {parseAssignment("mounting_yaw_pitch_roll_deg=[0,0,180]")};
  std::ostringstream told;
  EXPECT_EQ(runCheck(request, told), 0) << told.str();
}

TEST_F(CheckBag, WhatIsToldAndFarFromWhatTheBagShowsIsNamed) {
  const BagCheck mounting = check(bag_, false, {"mounting_yaw_pitch_roll_deg=[90,0,0]"});
  expectLine(mounting, FindingLevel::kOdd, {"mounting", "the configured mounting", "degrees apart"});
  expectLine(check(bag_, false, {"radar_doppler_sign=-1"}), FindingLevel::kOdd,
             {"Doppler", "the configured radar_doppler_sign is -1, and the bag shows 1"});
  // The sigma of what the bag shows is not that of what is told.
  const double usual = SmootherOptions().extrinsics_rotation_sigma;
  EXPECT_EQ(configOf(mounting).odometry.smoother.extrinsics_rotation_sigma, usual);
  EXPECT_LT(configOf(check(bag_, false)).odometry.smoother.extrinsics_rotation_sigma, usual);
}

TEST_F(CheckBag, ALeverArmIsEstimatedFromWhereTheBagShowsIt) {
  const Extrinsics mounting = setup_.T_IR;
  setup_.T_IR.l_I = {0.04, -0.07, 0.21};
  const std::string bag = folder_ + "/lever.bag";
  write("medium", 60.0, BagFormat::kIrs, bag);
  const Eigen::Vector3d true_l_I = std::exchange(setup_.T_IR, mounting).l_I;
  const BagCheck odd = check(bag);
  EXPECT_TRUE(odd.ready()) << describeCheck(odd);
  const Config config = configOf(odd);
  EXPECT_EQ(config.odometry.smoother.estimate_extrinsics, EstimateExtrinsics::kPose);
  EXPECT_LT((config.odometry.radar.T_IR.l_I - true_l_I).norm(), 0.1)
      << config.odometry.radar.T_IR.l_I.transpose();
  const RadarSummary radar = run(odd).radars.front();
  EXPECT_NEAR(radar.final_offset_s, setup_.time_offset.constant, 3.0 * radar.final_offset_sigma_s);
  // A run that holds the mounting would hold an arm that is a decimetre wrong.
  const Config held = configOf(check(bag, false, {"estimate_extrinsics=none"}));
  EXPECT_EQ(held.odometry.smoother.estimate_extrinsics, EstimateExtrinsics::kLeverArm);
  EXPECT_EQ(held.odometry.radar.T_IR.l_I, Eigen::Vector3d::Zero());
  // The estimate starts from what the user has measured.
  const std::string tape = "extrinsics_translation=[0.04,-0.07,0.21]";
  const Config measured = configOf(check(bag, false, {tape}));
  EXPECT_EQ(measured.odometry.smoother.estimate_extrinsics, EstimateExtrinsics::kPose);
  EXPECT_EQ(measured.odometry.radar.T_IR.l_I, true_l_I);
  EXPECT_EQ(measured.odometry.radar.extrinsics_translation_sigma, 0.05);
  const Config exact = configOf(check(bag, false, {"extrinsics_translation_sigma=0.01", tape}));
  EXPECT_EQ(exact.odometry.radar.extrinsics_translation_sigma, 0.01);
}

/// The run is good: the estimate outvoted the points at wrong directions.
TEST_F(CheckBag, ABriefDivergenceDoesNotMakeATrialRunBad) {
  const simulation::SimulationOptions plain = setup_;
  setup_.seed = 9;
  setup_.time_offset.constant = 0.0;
  setup_.T_IR.q_IR = rotationOf({0.0, 0.0, 0.0});
  setup_.radar.rate = 20.0;
  setup_.radar.points_mean = 20.0;
  setup_.radar.points_sigma = 3.0;
  setup_.radar.ambiguous_share = 0.2;
  const std::string bag = folder_ + "/ambiguous.bag";
  simulation::MotionRequest request;
  request.name = "walk";
  request.seed = setup_.seed;
  request.duration = 100.0;
  const simulation::Motion motion = simulation::makeMotion(request);
  writeSimulationBag(bag, motion, simulation::simulate(motion, setup_), setup_.start, {});
  setup_ = plain;
  const BagCheck good = check(bag);
  EXPECT_TRUE(good.ready()) << describeCheck(good);
}

/// A vehicle turns about one axis only, so gravity does not show it. The radar contradicts each turn.
TEST_F(CheckBag, AGyroThatIsInvertedIsNotReady) {
  simulation::MotionRequest request;
  request.name = "ground_vehicle";
  request.seed = 1;
  request.duration = 60.0;
  const simulation::Motion motion = simulation::makeMotion(request);
  simulation::SimulationOptions setup = setup_;
  setup.seed = 1;
  simulation::SensorData data = simulation::simulate(motion, setup);
  for (ImuMeasurement& sample : data.imu.samples) sample.angular_velocity = -sample.angular_velocity;
  const std::string bag = folder_ + "/inverted.bag";
  writeSimulationBag(bag, motion, data, setup.start, {});
  const BagCheck odd = check(bag);
  expectLine(odd, FindingLevel::kMissing, {"trial run"});
  EXPECT_NE(odd.to_do.find("inverted axis of the gyro"), std::string::npos) << odd.to_do;
}

TEST_F(CheckBag, ABagOfAFrameThatVibratesRunsWell) {
  const double vibration = setup_.imu.accel_vibration;
  setup_.imu.accel_vibration = 2.0;  // [m/s^2]
  const std::string bag = folder_ + "/vibrates.bag";
  write("medium", 50.0, BagFormat::kIrs, bag);
  setup_.imu.accel_vibration = vibration;
  const BagCheck odd = check(bag);
  expectLine(odd, FindingLevel::kOdd, {"noise", "the frame vibrates"});
  EXPECT_EQ(run(odd).diagnosis.verdict, RunVerdict::kGood) << odd.yaml;
}

TEST_F(CheckBag, ARadarWithoutElevationIsFoundAndTakenToBeLevel) {
  const simulation::SimulationOptions before = setup_;
  setup_.radar.measures_elevation = false;
  setup_.radar.fov_elevation = 5.0;
  setup_.T_IR.q_IR = rotationOf({30.0 * kDegree, 0.0, 0.0});
  const std::string bag = folder_ + "/flat.bag";
  write("ground_vehicle", 50.0, BagFormat::kIrs, bag);
  const BagCheck odd = check(bag, false);
  const double turn = turnFromTruth(odd);
  setup_ = before;
  expectLine(odd, FindingLevel::kOdd, {"points", "no elevation", "without tilt"});
  expectLine(odd, FindingLevel::kOdd, {"mounting", "pitch 0.0, roll 0.0"});
  EXPECT_LT(turn, 5.0) << describeCheck(odd);
}

TEST_F(CheckBag, ExitStatusAndFiles) {
  CheckRequest request;
  std::ostringstream out;
  const auto refused = [&] {
    try {
      runCheck(request, out);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string("not refused");
  };
  EXPECT_EQ(refused(), "missing argument BAG");
  request.bags = {folder_ + "/none.bag"};
  EXPECT_THROW(runCheck(request, out), std::runtime_error);
  request.bags = {bag_};
  request.out = bag_;
  EXPECT_NE(refused().find("expected another file"), std::string::npos);
  request.out = request.rig = folder_ + "/my.yaml";
  EXPECT_EQ(refused(), "--rig " + request.rig + ": expected another file than that of --out");
  request.rig.clear();
  request.set = {parseAssignment("bag_duration=40")};  // of this bag alone
  EXPECT_EQ(runCheck(request, out), 0);
  BagRun bag_run;
  bag_run.bags = {bag_};
  bag_run.config = makeConfig(readParameterFile(request.out));
  EXPECT_EQ(bag_run.config.bag_duration, 0.0);
  EXPECT_EQ(runBag(bag_run).divergences, 0u);
}

TEST_F(CheckBag, AnEditedConfigurationIsKept) {
  CheckRequest request;
  request.bags = {bag_};
  request.try_out = false;
  request.out = folder_ + "/edited.yaml";
  std::ofstream(request.out) << "# mine\n";
  std::ostringstream out, again;
  EXPECT_EQ(runCheck(request, out), 0);
  EXPECT_NE(out.str().find("(the old file is now " + request.out + "~)"), std::string::npos) << out.str();
  EXPECT_EQ(contents(request.out + "~"), "# mine\n");
  // The same once more: nothing is replaced, and the older one stays.
  EXPECT_EQ(runCheck(request, again), 0);
  EXPECT_EQ(again.str().find("what was there"), std::string::npos) << again.str();
  EXPECT_EQ(contents(request.out + "~"), "# mine\n");
}

TEST_F(CheckBag, PartsOfOneRecordingAreReadAsOne) {
  const std::string first = folder_ + "/part_0.bag", second = folder_ + "/part_1.bag";
  {
    const rosbag::Bag in(bag_);
    rosbag::Bag a(first, rosbag::bagmode::Write), b(second, rosbag::bagmode::Write);
    rosbag::View view(in);
    const ros::Time middle = view.getBeginTime() + ros::Duration(25.0);
    for (const rosbag::MessageInstance& instance : view)
      (instance.getTime() < middle ? a : b).write(instance.getTopic(), instance.getTime(), instance);
  }
  using Parts = std::vector<std::vector<std::string>>;
  EXPECT_EQ(recordingsOf({second, first}), (Parts{{first, second}}));
  EXPECT_EQ(recordingsOf({bag_, first}), (Parts{{bag_}, {first}})) << "they are of the same time";
  CheckRequest request;
  request.bags = {second, first};
  request.out = folder_ + "/parts.yaml";
  std::ostringstream out;
  ASSERT_EQ(runCheck(request, out), 0) << out.str();
  EXPECT_NE(out.str().find("--bag " + first + " --bag " + second + " --config"), std::string::npos)
      << out.str();
  EXPECT_EQ(contents(request.out).find("init_mode"), std::string::npos) << "the recording begins at rest";
}

TEST_F(CheckBag, ADamagedBagIsNamed) {
  std::string bytes = contents(bag_);
  const std::size_t at = bytes.rfind("v_doppler_mps");  // in the last cloud
  ASSERT_NE(at, std::string::npos);
  // The length of this text comes before it. Now it ends beyond the message.
  for (std::size_t i = 1; i <= 4; ++i) bytes[at - i] = '\x7f';
  CheckRequest request;
  request.bags = {folder_ + "/damaged.bag", bag_};
  std::ofstream(request.bags.front(), std::ios::binary) << bytes;
  std::ostringstream out;
  try {
    runCheck(request, out);
    ADD_FAILURE() << out.str();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("bag " + request.bags.front() + ": perhaps it is damaged ("),
              std::string::npos)
        << error.what();
  }
}

TEST_F(CheckBag, TheNextCommandCanBePasted) {
  CheckRequest request;
  request.try_out = false;
  const std::string copy = folder_ + "/Bob's copy.bag";
  fs::copy_file(bag_, copy);
  request.bags = {copy};
  request.out = folder_ + "/my own.yaml";
  std::ostringstream out;
  EXPECT_EQ(runCheck(request, out), 0);
  EXPECT_NE(out.str().find("--bag '" + folder_ + "/Bob'\\''s copy.bag' --config '" + request.out + "'"),
            std::string::npos)
      << out.str();
  request.bags_go_away = true;
  EXPECT_EQ(runCheck(request, out), 0);
  EXPECT_NE(out.str().find("--bag BAG --config"), std::string::npos) << out.str();
}

}  // namespace
}  // namespace rio_t
