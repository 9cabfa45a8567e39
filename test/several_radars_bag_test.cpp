// Bags of several radars: files, keys, faults, and what the modes find.
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "rest_bag.h"
#include "rio_t/ros/bag/bag_runner.h"
#include "rio_t/ros/bag/simulation_bag.h"
#include "rio_t/ros/parameters/parameters.h"
#include "rio_t/simulation/motions.h"

namespace rio_t {
namespace {

const std::vector<std::string> kTwoTopics = {"/left", "/right"};

class TwoRadars : public RestBag {
 protected:
  Outcome runTwo(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"--set", "radars=[left, right]", "--set", "left/radar_topic=/left", "--set",
                               "right/radar_topic=/right"});
    return run(more);
  }
  void expectInSummary(const std::vector<std::string>& lines, const std::string& folder = "") const {
    const std::string yaml = contents(out_ + folder + "/summary.yaml");
    for (const std::string& line : lines) EXPECT_NE(yaml.find(line), std::string::npos) << line << yaml;
  }
  bool has(const std::string& file) const { return fs::exists(out_ + "/" + file); }
};

TEST_F(TwoRadars, EachHasItsFilesAndKeys) {
  BagContents what;
  what.radar_topics = kTwoTopics;
  writeBag(what);
  const Outcome outcome = runTwo();
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  for (const char* part : {"radar left\n", "radar right\n", "of 160 used", "of 80 used"})
    EXPECT_NE(outcome.out.find(part), std::string::npos) << part << outcome.out;
  const RunFiles files{{"left", "right"}, false};
  for (const std::string& name : files.names()) EXPECT_GT(fs::file_size(out_ + "/" + name), 0u) << name;
  EXPECT_FALSE(has("time_offset.csv"));
  EXPECT_FALSE(has("ego_velocity.csv"));
  expectInSummary({"scans_total: 160\n", "scans_total_left: 80\n", "scans_total_right: 80\n",
                   "\nscans_used_left: ", "\nscans_rejected_right: {", "\nfinal_offset_s_left: 0.",
                   "\nfinal_offset_sigma_s_right: 0.0", "\nradar_noise_left: {doppler: ",
                   "\nradar_doppler_step_right: ", "\nradar_points_per_scan_left: {p10: 30",
                   "saved: [trajectory.txt, trajectory_optimized.txt, navigation.csv, time_offset_left.csv"});
  const std::string yaml = contents(out_ + "/summary.yaml");
  EXPECT_EQ(yaml.find("\nfinal_offset_s:"), std::string::npos);
  EXPECT_EQ(yaml.find("extrinsics"), std::string::npos);
  // One line a scan, and each scan with its radar.
  for (const char* name : {"left", "right"}) {
    const std::string csv = contents(out_ + "/ego_velocity_" + name + ".csv");
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 81) << name;
  }
}

TEST_F(TwoRadars, OneNameIsOneRadarAndCarriesNone) {
  writeBag({});
  ASSERT_EQ(run().status, 0);
  const std::string plain = out_;
  out_ = folder_ + "/named";
  const Outcome outcome = run({"--set", "radars=[only]"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  for (const std::string& name : RunFiles{}.names())
    EXPECT_EQ(untimed(contents(out_ + "/" + name)), untimed(contents(plain + "/" + name))) << name;
}

TEST_F(TwoRadars, TheDiagnosisNamesTheSectionOfTheOnlyRadar) {
  writeBag({});
  for (const char* mode : {"online", "batch"}) {
    const Outcome outcome = run({"--set", "radars=[only]", "--set", "only/radar_max_azimuth=0.3", "--set",
                                 std::string("mode=") + mode});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("only/radar_max_azimuth 0.3 rad"), std::string::npos) << mode << outcome.out;
    EXPECT_TRUE(has("time_offset.csv"));
    expectInSummary({"\nfinal_offset_s: "});
  }
}

TEST_F(TwoRadars, MissingTopicsAndWrongTypesNameTheirRadar) {
  BagContents what;
  what.radar_topics = {"/left"};
  writeBag(what);
  expectError(runTwo(), {"no topic /right (right/radar_topic, sensor_msgs/PointCloud2)",
                         "--set radars=[NAME of the other]"});
  expectError(
      runTwo({"--set", "right/radar_topic=/other", "--set", "left/stamp_source=trigger", "--set",
              "left/trigger_topic=/absent"}),
      {"topic /other (right/radar_topic) is std_msgs/Header", "no topic /absent (left/trigger_topic"});
}

TEST_F(TwoRadars, EveryTransformThatIsMissingIsNamed) {
  BagContents what;
  what.radar_topics = kTwoTopics;
  what.cloud_frame = "front";
  writeBag(what);
  expectError(runTwo({"--set", "extrinsics_source=tf", "--set", "imu_frame=imu"}),
              {"radar left: no tf from front to imu ", "; radar right: no tf from front to imu ",
               "the bag has no tf"});
}

TEST_F(TwoRadars, OneTopicForBothIsRefusedAlsoIfOneHasNoSlash) {
  BagContents what;
  what.radar_topics = {"/left"};
  writeBag(what);
  expectError(runTwo({"--set", "right/radar_topic=left"}),
              {"right/radar_topic: expected another than that of left, got \"/left\" for both"});
}

TEST_F(TwoRadars, EachHasItsFormatAndItsStamps) {
  BagContents what;
  what.radar_topics = {"/left"};
  what.doppler_field = "speed";
  what.stamped = false;
  writeBag(what);
  {
    rosbag::Bag bag(bag_, rosbag::bagmode::Append);
    BagContents other;
    other.radar_topics = {"/right"};
    for (int k = 0; k < 80; ++k) {
      const ros::Time stamp = ros::Time(1000.0) + ros::Duration(0.1 * k);
      writeCloud(other, stamp, stamp + ros::Duration(100.001), k, &bag);
    }
  }
  const Outcome outcome = runTwo({"--set", "left/radar_field_doppler=speed", "--set",
                                  "left/stamp_source=arrival", "--set", "left/radar_stamp_shift=0.01"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  // Recorded 0.5 ms later than the IMU sample of that time; and shifted.
  EXPECT_NE(contents(out_ + "/ego_velocity_left.csv").find("\n1000.110500000,"), std::string::npos);
  EXPECT_NE(contents(out_ + "/ego_velocity_right.csv").find("\n1000.100000000,"), std::string::npos);
}

TEST_F(TwoRadars, OneThatGivesNothingIsSaidAndTheOtherGoesOn) {
  BagContents what;
  what.radar_topics = kTwoTopics;
  writeBag(what);
  Outcome outcome = runTwo({"--set", "right/radar_field_doppler=speed"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("topic /right: point cloud"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("every one of the 80 scans of radar right was rejected: cloud_not_usable 80"),
            std::string::npos)
      << outcome.err;
  // It stays at what was told.
  expectInSummary({"scans_used_right: 0\n", "final_offset_s_right: 0.000000000\n",
                   "final_offset_sigma_s_right: 0.075000000\n", "scans_rejected_left: {before_init"});

  expectError(runTwo({"--set", "radar_field_doppler=speed"}), {"topic /left: point cloud"});
}

TEST_F(TwoRadars, ABatchTakesTheSigmaOfEachSection) {
  BagContents what;
  what.radar_topics = kTwoTopics;
  writeBag(what);
  const Outcome outcome = runTwo({"--set", "mode=batch", "--set", "left/time_offset_sigma=0.01", "--set",
                                  "right/time_offset_sigma=0.02"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  // At rest nothing is learned.
  expectInSummary({"final_offset_sigma_s_left: 0.0100", "final_offset_sigma_s_right: 0.0200"});
}

TEST_F(TwoRadars, FilesOfAnEarlierRunAreNotTakenForItsOwn) {
  BagContents what;
  what.radar_topics = {"/left", "/right", "/sensor_platform/radar/scan"};
  writeBag(what);
  ASSERT_EQ(runTwo({"--set", "estimate_extrinsics=rotation"}).status, 0);
  EXPECT_TRUE(has("extrinsics_right.csv"));
  for (const char* name : {"time_offset_left.csv", "ego_velocity_right.csv"})
    std::filesystem::copy_file(out_ + "/" + name, out_ + "/my_" + name);
  std::filesystem::copy_file(out_ + "/time_offset_left.csv", out_ + "/time_offset_old.csv");
  ASSERT_EQ(run().status, 0);
  for (const char* name : {"time_offset_left.csv", "ego_velocity_right.csv", "extrinsics_left.csv"})
    EXPECT_FALSE(has(name)) << name;
  for (const char* name : {"time_offset.csv", "ego_velocity.csv", "my_time_offset_left.csv",
                           "my_ego_velocity_right.csv", "time_offset_old.csv"})
    EXPECT_TRUE(has(name)) << name;
  ASSERT_EQ(runTwo().status, 0);
  EXPECT_FALSE(has("time_offset.csv"));
  EXPECT_FALSE(has("ego_velocity.csv"));
}

/// A simulated rig that moves wildly, with two radars of different offsets and mountings.
class TwoSimulatedRadars : public TwoRadars {
 protected:
  static constexpr double kLeft = -0.009, kRight = 0.04;  // [s]

  void SetUp() override {
    TwoRadars::SetUp();
    simulation::MotionRequest request;
    request.name = "difficult";
    request.seed = 3;
    request.duration = 25.0;
    request.rest = {4.0, 0.0, 1.0};
    const simulation::Motion motion = simulation::makeMotion(request);
    simulation::SimulationOptions rig;
    rig.seed = 5;  // of both, so that they share the IMU
    const auto write = [&](const std::string& path, double offset, const Extrinsics& T_IR) {
      rig.time_offset = simulation::TimeOffsetProfile{};
      rig.time_offset.constant = offset;
      rig.T_IR = T_IR;
      writeSimulationBag(path, motion, simulation::simulate(motion, rig), rig.start, {});
    };
    write(bag_, kLeft, left_);
    write(folder_ + "/right.bag", kRight, right_);
    rosbag::Bag both(bag_, rosbag::bagmode::Append), other(folder_ + "/right.bag", rosbag::bagmode::Read);
    for (const rosbag::MessageInstance& message : rosbag::View(other, rosbag::TopicQuery(kTopic)))
      both.write("/right", message.getTime(), message);
  }

  Config config() const {
    Config config =
        makeConfig({parseAssignment("radars=[left, right]"), parseAssignment("right/radar_topic=/right"),
                    parseAssignment("left/radar_topic=" + kTopic)});
    config.odometry.radars[0].T_IR = left_;
    config.odometry.radars[1].T_IR = right_;
    return config;
  }

  void expectOffsets(const RunSummary& summary) const {
    ASSERT_EQ(summary.radars.size(), 2u);
    EXPECT_EQ(summary.radars[0].name, "left");
    EXPECT_NEAR(summary.radars[0].final_offset_s, kLeft, 1.5e-3);
    EXPECT_NEAR(summary.radars[1].final_offset_s, kRight, 1.5e-3);
    for (const RadarSummary& radar : summary.radars) {
      EXPECT_GT(radar.scans_used, 190u) << radar.name;
      EXPECT_GT(radar.final_offset_sigma_s, 0.0) << radar.name;
    }
    ASSERT_TRUE(summary.truth.has_value());
    EXPECT_LT(summary.truth->ate_m, 0.15);
  }

  const std::string kTopic = "/sensor_platform/radar/scan";
  const Extrinsics left_ = simulation::SimulationOptions{}.T_IR;
  const Extrinsics right_{Eigen::Vector3d(-0.1, -0.2, 0.05),
                          Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ())) * left_.q_IR};
};

TEST_F(TwoSimulatedRadars, EachOffsetIsFoundInEveryMode) {
  for (const RunMode mode : {RunMode::kOnline, RunMode::kBatch, RunMode::kRefine}) {
    SCOPED_TRACE(static_cast<int>(mode));
    Config config = this->config();
    config.mode = mode;
    config.refine_passes = 2;
    const RunSummary summary = runBag({{bag_}, out_, config, nullptr});
    expectOffsets(summary);
    if (mode != RunMode::kRefine) continue;
    // What the first pass found is off the stamps of the second, each radar's its own, and on its outputs
    // again.
    expectInSummary({"pass_offsets_s_left: [-0.0", "pass_offsets_s_right: [0.0"});
    EXPECT_NEAR(summary.radars[0].pass_offsets_s.at(0), kLeft, 1.5e-3);
    EXPECT_NEAR(summary.radars[1].pass_offsets_s.at(0), kRight, 1.5e-3);
    const auto stamps = [&](const std::string& folder) {
      const std::string csv = contents(out_ + folder + "/ego_velocity_right.csv");
      return csv.substr(csv.find('\n') + 1, 16);
    };
    EXPECT_EQ(stamps(""), stamps("/pass_1"));
  }
}

TEST_F(TwoSimulatedRadars, MountingsAreFoundEachItsOwn) {
  Config config = this->config();
  config.odometry.smoother.estimate_extrinsics = EstimateExtrinsics::kRotation;
  const Eigen::AngleAxisd wrong(0.08, Eigen::Vector3d(1.0, -2.0, 2.0).normalized());
  config.odometry.radars[1].T_IR.q_IR = wrong * right_.q_IR;
  const RunSummary summary = runBag({{bag_}, out_, config, nullptr});
  const auto error = [&](std::size_t k, const Extrinsics& truth) {
    return summary.radars.at(k).extrinsics->T_IR.q_IR.angularDistance(truth.q_IR);
  };
  EXPECT_LT(error(0, left_), 0.02);
  EXPECT_LT(error(1, right_), 0.02);
  EXPECT_NEAR(summary.radars[1].extrinsics->configured.q_IR.angularDistance(right_.q_IR), 0.08, 1e-9);
  EXPECT_TRUE(summary.radars[1].extrinsics->translationSigma().isZero());
  expectInSummary({"final_extrinsics_rotation_xyzw_left: [", "final_extrinsics_rotation_sigma_right: [0.0"});
}

TEST_F(TwoSimulatedRadars, AWrongMountingThatIsHeldIsDoubtful) {
  Config config = this->config();
  config.odometry.radars[1].T_IR.q_IR = Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitZ()) * right_.q_IR;
  const Diagnosis diagnosis = runBag({{bag_}, out_, config, nullptr}).diagnosis;
  EXPECT_EQ(diagnosis.verdict, RunVerdict::kDoubtful);
  ASSERT_FALSE(diagnosis.causes.empty());
  EXPECT_EQ(diagnosis.causes.front().name, "mounting_far");
  EXPECT_NE(diagnosis.causes.front().text.find("radar right"), std::string::npos)
      << diagnosis.causes.front().text;
  expectInSummary({"mounting_turn_left: [", "mounting_turn_sigma_right: [0.0"});
}

TEST_F(TwoSimulatedRadars, SameBagSameBytes) {
  const Config config = this->config();
  runBag({{bag_}, out_ + "/a", config, nullptr});
  runBag({{bag_}, out_ + "/b", config, nullptr});
  for (const std::string& name : runFiles(config).names())
    EXPECT_EQ(untimed(contents(out_ + "/a/" + name)), untimed(contents(out_ + "/b/" + name))) << name;
}

}  // namespace
}  // namespace rio_t
