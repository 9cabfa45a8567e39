// check_bag on simulated bags, as they are and with one thing odd in each.
#include "rio_t/ros/bag/check_bag.h"

#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/point_cloud2_iterator.h>
#include <stdlib.h>

#include <algorithm>
#include <functional>
#include <optional>
#include <sstream>

#include "../src/ros/bag/inspect_recording.h"
#include "rio_t/ros/bag/bag_runner.h"
#include "rio_t/ros/bag/simulation_bag.h"
#include "rio_t/ros/parameters/parameters.h"
#include "rio_t/simulation/motions.h"
#include "rio_t/simulation/presets.h"
#include "rio_t/simulation/simulation.h"
#include "run_files.h"

namespace rio_t {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;

/// Changes a message; false leaves it out.
struct Changes {
  std::function<bool(sensor_msgs::Imu&)> imu = nullptr;
  std::function<bool(sensor_msgs::PointCloud2&)> cloud = nullptr;
  bool keep_triggers = false;
  int copies = 1;  // of each message
};

class CheckBag : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    std::string name = (fs::temp_directory_path() / "rio_t_check_bag_XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    setup_ = simulation::SimulationOptions();
    setup_.seed = 5;
    setup_.time_offset.constant = 0.03;
    bag_ = folder_ + "/plain.bag";
    write("medium", 50.0, BagFormat::kIrs, bag_);
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  static void write(const std::string& motion_name, double duration, BagFormat format,
                    const std::string& path) {
    simulation::MotionRequest request;
    request.name = motion_name;
    request.seed = setup_.seed;
    request.duration = duration;
    request.rest.static_start = 5.0;
    request.rest.static_end = 0.0;
    const simulation::Motion motion = simulation::makeMotion(request);
    SimulationBagOptions options;
    options.format = format;
    writeSimulationBag(path, motion, simulation::simulate(motion, setup_), setup_.start, options);
  }

  /// The plain bag with changes.
  static std::string rewritten(const std::string& name, const Changes& changes) {
    std::string path = folder_ + "/" + name + ".bag";
    const rosbag::Bag in(bag_);
    rosbag::Bag out(path, rosbag::bagmode::Write);
    rosbag::View view(in);
    for (const rosbag::MessageInstance& instance : view) {
      if (const auto imu = instance.instantiate<sensor_msgs::Imu>()) {
        if (changes.imu && !changes.imu(*imu)) continue;
        for (int k = 0; k < changes.copies; ++k) out.write(instance.getTopic(), instance.getTime(), *imu);
      } else if (const auto cloud = instance.instantiate<sensor_msgs::PointCloud2>()) {
        if (changes.cloud && !changes.cloud(*cloud)) continue;
        for (int k = 0; k < changes.copies; ++k) out.write(instance.getTopic(), instance.getTime(), *cloud);
      } else if (changes.keep_triggers) {
        out.write(instance.getTopic(), instance.getTime(), instance);
      }
    }
    return path;
  }

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

  static BagCheck check(const std::string& bag, bool try_out = true) {
    CheckRequest request;
    request.bags = {bag};
    request.try_out = try_out;
    return checkBag(bag, request);
  }

  static Config configOf(const BagCheck& check) {
    std::istringstream yaml(check.yaml);
    return makeConfig(readParameters(yaml, "my.yaml"));
  }

  /// Runs the odometry with what was written, as a user would.
  static RunSummary run(const BagCheck& check) {
    BagRun bag_run;
    bag_run.bags = {check.bag};
    bag_run.config = configOf(check);
    return runBag(bag_run);
  }

  static void expectRuns(const BagCheck& check) {
    ASSERT_TRUE(check.ready()) << describeCheck(check);
    const RunSummary summary = run(check);
    EXPECT_EQ(summary.divergences, 0u) << check.yaml;
    EXPECT_EQ(summary.health_at_end, "ok") << check.yaml;
    EXPECT_GT(summary.scansUsed(), 7 * summary.scansTotal() / 10) << check.yaml;
  }

  /// One line of that level has all parts.
  static void expectLine(const BagCheck& check, FindingLevel level, const std::vector<std::string>& parts) {
    EXPECT_EQ(std::count_if(check.findings.begin(), check.findings.end(),
                            [&](const Finding& finding) {
                              const std::string text = finding.subject + " " + finding.text;
                              return finding.level == level &&
                                     std::all_of(parts.begin(), parts.end(), [&](const std::string& part) {
                                       return text.find(part) != std::string::npos;
                                     });
                            }),
              1)
        << parts.front() << " in\n"
        << describeCheck(check);
  }

  static double turnFromTruth(const BagCheck& check) {
    return configOf(check).odometry.T_IR.q_IR.angularDistance(setup_.T_IR.q_IR) / kDegree;
  }

  static std::string folder_, bag_;
  static simulation::SimulationOptions setup_;
};
std::string CheckBag::folder_, CheckBag::bag_;
simulation::SimulationOptions CheckBag::setup_;

float* fieldOf(sensor_msgs::PointCloud2& cloud, std::size_t point, const std::string& name) {
  for (const sensor_msgs::PointField& field : cloud.fields) {
    if (field.name == name)
      return reinterpret_cast<float*>(&cloud.data[point * cloud.point_step + field.offset]);
  }
  throw std::runtime_error("no field " + name);
}

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
  expectLine(odd, FindingLevel::kOdd, {"left-handed"});
  expectRuns(odd);
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
  const BagCheck asked = checkBag(bag, request);
  expectLine(asked, FindingLevel::kMissing, {"gravity is missing"});
}

TEST_F(CheckBag, ABagRecordedTwiceIsReady) {
  Changes changes;
  changes.copies = 2;
  const BagCheck odd = check(rewritten("twice", changes));
  ASSERT_TRUE(odd.ready()) << describeCheck(odd);
  EXPECT_EQ(odd.to_do, "") << describeCheck(odd);
  expectLine(odd, FindingLevel::kOk, {"trial run", "no divergence"});
  expectLine(odd, FindingLevel::kOdd, {"/sensor_platform/imu", "duplicate stamps"});
  expectLine(odd, FindingLevel::kOk, {"/sensor_platform/radar/scan", "duplicate stamps"});
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

TEST_F(CheckBag, ACloudWithoutDopplerIsNamedWithItsFields) {
  Changes changes;
  changes.cloud = [](sensor_msgs::PointCloud2& cloud) {
    for (sensor_msgs::PointField& field : cloud.fields) {
      if (field.name == "v_doppler_mps") field.name = "label";
    }
    return true;
  };
  const BagCheck odd = check(rewritten("no_doppler", changes));
  expectLine(odd, FindingLevel::kMissing, {"no field with the Doppler", "snr_db, label"});
  EXPECT_FALSE(odd.ready());
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
  const Recording recording = readRecording(bag, {});
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
  expectLine(odd, FindingLevel::kOdd, {"/lidar/points", "no field with the Doppler", "x, y, z"});
}

TEST_F(CheckBag, OnlyTopicsThatAreAskedForAreRead) {
  CheckRequest request;
  request.imu_topic = "/sensor_platform/imu";
  request.radar_topics = {"/sensor_platform/radar/scan"};
  const Recording lidar =
      readRecording(withTopic("asked_lidar", "/lidar/points", 10.0, lidarCloud()), request);
  ASSERT_EQ(lidar.clouds.size(), 1u);
  EXPECT_EQ(lidar.clouds.front().topic, request.radar_topics.front());
  const Recording imus =
      readRecording(withTopic("asked_imu", "/camera/imu", 200.0, sensor_msgs::Imu()), request);
  ASSERT_EQ(imus.imus.size(), 1u);
  EXPECT_EQ(imus.imus.front().topic, request.imu_topic);
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

TEST_F(CheckBag, AnotherUnitOfThePowerIsNamed) {
  Changes changes;
  changes.cloud = [](sensor_msgs::PointCloud2& cloud) {
    for (std::size_t i = 0; i < cloud.width; ++i) *fieldOf(cloud, i, "snr_db") *= 10.0F;
    return true;
  };
  const BagCheck odd = check(rewritten("power", changes));
  expectLine(odd, FindingLevel::kOdd, {"format", "snr_decidb"});
  EXPECT_EQ(configOf(odd).radar_overrides.power_unit, "snr_decidb");
  expectRuns(odd);
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
  const Config config = configOf(pair);
  ASSERT_EQ(config.radars.size(), 2u) << pair.yaml;
  for (const Config& radar : config.radars) {
    const Extrinsics& truth = kart.options.radars.at(radar.radar_name).T_IR;
    EXPECT_LT(radar.odometry.T_IR.q_IR.angularDistance(truth.q_IR) / kDegree, 15.0) << radar.radar_name;
  }
}

TEST_F(CheckBag, ExitStatusAndFiles) {
  CheckRequest request;
  std::ostringstream out, err;
  EXPECT_EQ(runCheck(request, out, err), 2);
  request.bags = {folder_ + "/none.bag"};
  EXPECT_EQ(runCheck(request, out, err), 1);
  EXPECT_NE(err.str().find("no such file"), std::string::npos);
  request.bags = {bag_};
  request.out = bag_;
  EXPECT_EQ(runCheck(request, out, err), 2);
  request.out = folder_ + "/my.yaml";
  EXPECT_EQ(runCheck(request, out, err), 0) << err.str();
  BagRun bag_run;
  bag_run.bags = {bag_};
  bag_run.config = makeConfig(readParameterFile(request.out));
  EXPECT_EQ(runBag(bag_run).divergences, 0u);
}

}  // namespace
}  // namespace rio_t
