// What a run of a bag writes and says.
#include "rio_t/ros/bag/bag_runner.h"

#include <geometry_msgs/PoseStamped.h>
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <sensor_msgs/FluidPressure.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>
#include <vector>

#include "../src/ros/bag/run_log.h"
#include "rest_bag.h"
#include "rio_t/core/format.h"
#include "rio_t/ros/parameters/parameters.h"

namespace rio_t {
namespace {

using BagRunner = RestBag;

TEST_F(BagRunner, AtRestItStaysAndWritesEveryFile) {
  writeBag({});
  const Outcome outcome = run({"__name:=rio_t_bag", "__log:=/dev/null"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  for (const std::string& name : RunFiles{}.names()) EXPECT_GT(fs::file_size(out_ + "/" + name), 0u) << name;
  for (const char* row : {"path", "end to start", "time offset", "scans", "speed", "files in"}) {
    EXPECT_NE(outcome.out.find(row), std::string::npos) << row;
  }
  EXPECT_EQ(contents(out_ + "/time_offset.csv").rfind("stamp,offset_s,sigma_s\n100", 0), 0u);
  EXPECT_EQ(contents(out_ + "/ego_velocity.csv")
                .rfind("stamp,vx,vy,vz,sigma_x,sigma_y,sigma_z,inliers,points,status\n1000.000000000,", 0),
            0u);
  EXPECT_EQ(contents(out_ + "/biases.csv").rfind("stamp,bgx,bgy,bgz,bax,bay,baz\n100", 0), 0u);
  for (const StampedPose& pose : readTum(out_ + "/trajectory.txt")) EXPECT_LT(pose.p_W.norm(), 0.02);
  const std::string navigation = contents(out_ + "/navigation.csv");
  EXPECT_EQ(navigation.rfind("stamp,vx,vy,vz,sigma_px,", 0), 0u);
  // Ten lines a second, from the initialisation at 3 s to the end at 8 s.
  EXPECT_NEAR(static_cast<double>(std::count(navigation.begin(), navigation.end(), '\n')), 51.0, 2.0);
}

TEST_F(BagRunner, TheSmallestAndTheLargestSigmasGiveNumbers) {
  writeBag({4.0});
  int runs = 0;
  for (const ParameterDescription& about : parameterDescriptions()) {
    if (about.type != "number" || about.key.find("sigma") == std::string::npos) continue;
    for (const double end : {about.min, about.max}) {
      BagRun bag_run{{bag_}, "", Config{}, nullptr};
      try {
        bag_run.config = withParameters(Config{}, {{about.key, {end}, "test"}});
      } catch (const ConfigError&) {
        continue;  // the end does not belong to the range, or is no number
      }
      SCOPED_TRACE(about.key + " " + std::to_string(end));
      const RunSummary summary = runBag(bag_run);
      ++runs;
      EXPECT_TRUE(std::isfinite(summary.path_length_m));
      EXPECT_LT(summary.path_length_m, 0.05);
    }
  }
  EXPECT_GT(runs, 30);
}

TEST_F(BagRunner, EveryScanIsAccountedFor) {
  writeBag({});
  BagRun bag_run{{bag_}, out_, Config{}, nullptr};
  const RunSummary summary = runBag(bag_run);
  EXPECT_EQ(summary.imu_count, 1600u);
  EXPECT_EQ(summary.scansTotal(), 80u);
  std::uint64_t rejected = 0;
  for (const auto& [reason, count] : summary.radars.front().scans_rejected) rejected += count;
  EXPECT_EQ(summary.scansUsed() + rejected, summary.scansTotal());
  EXPECT_GT(summary.scansUsed(), 40u);
  const std::string yaml = contents(out_ + "/summary.yaml");
  for (const char* key :
       {"imu_count: 1600\n", "scans_total: 80\n", "scans_used: ", "scans_rejected: {",
        "solver_terminations: {converged: ", "path_length_m: ", "end_to_start_2d_m: ", "end_to_start_3d_m: ",
        "final_offset_s: ", "final_offset_sigma_s: ", "imu_noise: {accel: 0.", "radar_noise: {doppler: 0.",
        "radar_doppler_step: 0.5", "radar_doppler_step_from: unknown\n",
        "radar_doppler_span: 0.000000\nradar_doppler_span_from: unknown\n", "radar_points_per_scan: {p10: ",
        "saved: [trajectory.txt", "estimation_seconds: ", "realtime_factor: "}) {
    EXPECT_NE(yaml.find(key), std::string::npos) << key;
  }
  EXPECT_EQ(yaml.find("ate_m"), std::string::npos);
}

TEST_F(BagRunner, StepAndSpanOfTheDopplerAreToldWithTheirSources) {
  const auto told = [&](const KnownDoppler& step, const KnownDoppler& span, const char* in_summary,
                        const char* in_table) {
    RunSummary summary;
    summary.radars.emplace_back();
    summary.radars.front().knowledge = {{}, step, span, {}};
    RunOutput(out_).finish(summary);
    EXPECT_NE(contents(out_ + "/summary.yaml").find(in_summary), std::string::npos) << in_summary;
    EXPECT_NE(describeRun(summary, out_).find(in_table), std::string::npos) << in_table;
  };
  told({0.125, DopplerSource::kUnknown}, {},
       "radar_doppler_step: 0.125000\nradar_doppler_step_from: unknown\n", "not known");
  told({0.49, DopplerSource::kGiven}, {}, "radar_doppler_step: 0.490000\nradar_doppler_step_from: given\n",
       "0.490 m/s, given");
  told({0.0, DopplerSource::kData}, {}, "radar_doppler_step: 0.000000\nradar_doppler_step_from: data\n",
       "none, from the data");
  told({}, {}, "radar_doppler_span: 0.000000\nradar_doppler_span_from: unknown\n", "none seen");
  told({}, {4.0, DopplerSource::kGiven}, "radar_doppler_span: 4.000000\nradar_doppler_span_from: given\n",
       "4.000 m/s, given");
  told({}, {3.0, DopplerSource::kData}, "radar_doppler_span: 3.000000\nradar_doppler_span_from: data\n",
       "3.000 m/s, from the data");
}

TEST_F(BagRunner, WhyTheSolverStoppedIsTold) {
  RunSummary summary;
  summary.solver_terminations = {{"at_bound", 253}, {"converged", 66}};
  RunOutput(out_).finish(summary);
  EXPECT_NE(contents(out_ + "/summary.yaml").find("solver_terminations: {at_bound: 253, converged: 66}\n"),
            std::string::npos);
  EXPECT_NE(describeRun(summary, out_).find("253 of 319 windows at_bound"), std::string::npos);
  summary.solver_terminations = {{"converged", 66}};
  EXPECT_EQ(describeRun(summary, out_).find("solver"), std::string::npos);
}

TEST_F(BagRunner, SameBagSameBytes) {
  writeBag({});
  ASSERT_EQ(run().status, 0);
  const std::string first = out_;
  out_ = folder_ + "/again";
  ASSERT_EQ(run().status, 0);
  for (const std::string& name : RunFiles{}.names()) {
    if (name == "summary.yaml") continue;
    EXPECT_EQ(contents(first + "/" + name), contents(out_ + "/" + name)) << name;
  }
  EXPECT_EQ(untimed(contents(first + "/summary.yaml")), untimed(contents(out_ + "/summary.yaml")));
}

TEST_F(BagRunner, TheWholeBagAtOnceKeepsTheOnlineRunBesideIt) {
  BagContents what;
  what.ground_truth = true;
  writeBag(what);
  const Outcome outcome = run({"--set", "mode=batch"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("converged after"), std::string::npos) << outcome.out;
  const std::string yaml = contents(out_ + "/summary.yaml");
  for (const char* line :
       {"mode: batch\n", "imu_count: 1600\n", "scans_total: 80\n", "batch_converged: true\n",
        "solver_terminations: {converged: 1}\n", "\nate_m: 0.0"})
    EXPECT_NE(yaml.find(line), std::string::npos) << line << yaml;
  const std::string online = contents(out_ + "/online/summary.yaml");
  EXPECT_NE(online.find("mode: online\n"), std::string::npos);
  EXPECT_EQ(online.find("batch"), std::string::npos);
  for (const std::string& name : RunFiles{}.names()) {
    EXPECT_GT(fs::file_size(out_ + "/" + name), 0u) << name;
    EXPECT_GT(fs::file_size(out_ + "/online/" + name), 0u) << name;
  }
  // One state a sample, from the same sample on; one line a scan in the same order.
  const Trajectory whole = readTum(out_ + "/trajectory.txt"),
                   causal = readTum(out_ + "/online/trajectory.txt");
  EXPECT_NEAR(static_cast<double>(whole.size()), static_cast<double>(causal.size()), 1.0);
  EXPECT_EQ(whole.back().time, causal.back().time);
  for (const StampedPose& pose : whole) EXPECT_LT(pose.p_W.norm(), 0.02);
  EXPECT_EQ(contents(out_ + "/ego_velocity.csv"), contents(out_ + "/online/ego_velocity.csv"));
  EXPECT_EQ(readTum(out_ + "/trajectory_optimized.txt").size(),
            readTum(out_ + "/online/trajectory_optimized.txt").size());
}

TEST_F(BagRunner, PassesTakeTheOffsetOffTheStampsAndGiveItBack) {
  writeBag({});
  const std::vector<std::string> initial = {"--set", "time_offset_initial=0.02"};
  ASSERT_EQ(run(initial).status, 0);
  const std::string online = out_;
  out_ = folder_ + "/refined";
  const Outcome outcome =
      run({"--set", "time_offset_initial=0.02", "--set", "mode=refine", "--set", "refine_passes=2"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("after passes"), std::string::npos) << outcome.out;
  // At rest nothing is learnt: what was believed at first stays, whichever way it is told the estimator.
  const std::string yaml = contents(out_ + "/summary.yaml");
  EXPECT_NE(yaml.find("mode: refine\n"), std::string::npos);
  EXPECT_NE(yaml.find("pass_offsets_s: [0.020"), std::string::npos) << yaml;
  EXPECT_NE(yaml.find("final_offset_s: 0.020"), std::string::npos) << yaml;
  EXPECT_EQ(untimed(contents(out_ + "/pass_1/summary.yaml")), untimed(contents(online + "/summary.yaml")));
  EXPECT_FALSE(fs::exists(out_ + "/pass_2"));
  // The stamps in the files are those of the bag in every pass.
  const auto stamps = [](const std::string& path) {
    std::ifstream file(path);
    std::string line, all;
    while (std::getline(file, line)) all += line.substr(0, line.find(',')) + "\n";
    return all;
  };
  EXPECT_EQ(stamps(out_ + "/ego_velocity.csv"), stamps(online + "/ego_velocity.csv"));
  EXPECT_EQ(stamps(out_ + "/time_offset.csv"), stamps(online + "/time_offset.csv"));
  expectError(run({"--set", "mode=fast"}), {"mode", "online, batch, refine"});
  expectError(run({"--set", "refine_passes=0"}), {"refine_passes"});
}

TEST_F(BagRunner, GroundTruthComesFromTheTopicOrAFile) {
  BagContents what;
  what.ground_truth = true;
  writeBag(what);
  Outcome outcome = run();
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(contents(out_ + "/summary.yaml").find("\nate_m: 0.0"), std::string::npos);

  std::ofstream(folder_ + "/truth.txt") << "1004.0 0 0 0 0 0 0 1\n1005.0 3 0 0 0 0 0 1\n";
  outcome = run({"--set", "ground_truth=" + folder_ + "/truth.txt"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  // The estimate rests, the truth moved 3 m: rmse of 0 and 3.
  EXPECT_NE(contents(out_ + "/summary.yaml").find("\nate_m: 2.1"), std::string::npos);

  outcome = run({"--ground-truth", folder_ + "/truth.txt"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(contents(out_ + "/summary.yaml").find("\nate_m: 2.1"), std::string::npos) << "the option, too";

  expectError(run({"--set", "ground_truth=" + folder_ + "/none.txt"}), {folder_ + "/none.txt"});
  std::ofstream(folder_ + "/elsewhen.txt") << "5.0 0 0 0 0 0 0 1\n6.0 3 0 0 0 0 0 1\n";
  expectError(run({"--set", "ground_truth=" + folder_ + "/elsewhen.txt"}), {"ground truth", "elsewhen.txt"});
}

TEST_F(BagRunner, EveryModeSavesItsEstimateThoughTheGroundTruthDoesNotMatch) {
  writeBag({});
  const std::string truth = folder_ + "/elsewhen.txt";
  std::ofstream(truth) << "5.0 0 0 0 0 0 0 1\n6.0 3 0 0 0 0 0 1\n";
  for (const std::string mode : {"online", "batch", "refine"}) {
    out_ = folder_ + "/" + mode;
    expectError(run({"--set", "ground_truth=" + truth, "--set", "mode=" + mode, "--set", "refine_passes=2"}),
                {"ground truth", truth});
    EXPECT_NE(contents(out_ + "/summary.yaml").find("mode: " + mode + "\n"), std::string::npos) << mode;
    EXPECT_GT(readTum(out_ + "/trajectory.txt").size(), 100U) << mode;
  }
}

TEST_F(BagRunner, ItSavesItsEstimateThoughTheTruthTopicCannotBeUsed) {
  const auto run_with = [&](const geometry_msgs::PoseStamped& pose, const std::string& md5) {
    BagContents what;
    what.ground_truth = true;
    writeBag(what);
    const auto header = boost::make_shared<ros::M_string>();
    *header = {{"type", "geometry_msgs/PoseStamped"}, {"md5sum", md5}, {"message_definition", "other"}};
    rosbag::Bag(bag_, rosbag::bagmode::Append)
        .write("/ground_truth/pose", pose.header.stamp + ros::Duration(100.0), pose, header);
    fs::remove_all(out_);
    Outcome outcome = run();
    EXPECT_GT(readTum(out_ + "/trajectory.txt").size(), 100U);
    EXPECT_NE(contents(out_ + "/summary.yaml").find("verdict: "), std::string::npos);
    EXPECT_EQ(contents(out_ + "/summary.yaml").find("ate_m"), std::string::npos);
    return outcome;
  };
  geometry_msgs::PoseStamped pose;
  pose.header.stamp = ros::Time(1008.5);
  pose.pose.orientation.w = 1.0;
  const std::string name = "ground truth topic /ground_truth/pose: ";
  expectError(run_with(pose, std::string(32, '0')), {name, "a message of another version of its type"});
  const std::string md5 = ros::message_traits::MD5Sum<geometry_msgs::PoseStamped>::value();
  pose.pose.orientation.w = 1.02;
  expectError(run_with(pose, md5), {name, "the pose of stamp 1008.500000000 has a quaternion of norm 1.02",
                                    "expected finite numbers and a norm of 1"});
  pose.pose.orientation.w = 1.0;
  pose.pose.position.x = std::nan("");
  expectError(run_with(pose, md5), {name, "1008.500000000 has a position that is not finite"});
}

TEST_F(BagRunner, ATrajectoryThatStartsAgainIsDoubtful) {
  BagContents what;
  what.duration = 16.0;
  what.ground_truth = true;
  for (const double jump : {5.0, -5.0}) {
    what.jump = jump;
    writeBag(what);
    const Outcome outcome = run();
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    const std::string where = jump > 0.0 ? "jump ahead from 1007.995 s to 1013.500 s, more than "
                                           "max_bridged_imu_gap 3 s. There the trajectory starts again"
                                         : "jump back from 1007.995 s to 1003.500 s. There the trajectory";
    EXPECT_NE(outcome.err.find("warning: topic /sensor_platform/imu: The stamps of the IMU " + where),
              std::string::npos)
        << outcome.err;
    EXPECT_NE(outcome.out.find(where), std::string::npos) << outcome.out;
    const std::string yaml = contents(out_ + "/summary.yaml");
    for (const char* part : {"verdict: doubtful\n", "imu_clock_restart: 1", "name: imu_clock_restart"})
      EXPECT_NE(yaml.find(part), std::string::npos) << part << yaml;
    // No number across the jump, and no pose lost before it.
    EXPECT_NE(outcome.err.find("starts again, so it is not compared with the ground truth"),
              std::string::npos);
    for (const char* part : {"ate_m", "end_to_start"}) EXPECT_EQ(yaml.find(part), std::string::npos) << yaml;
    EXPECT_NE(contents(out_ + "/trajectory_optimized.txt").find("\n1007.8"), std::string::npos);
  }
  what.ground_truth = false;
  // Before there is a trajectory, none starts again. A driver may set its clock first.
  what.jump = 5.0;
  what.jump_at = 0.5;
  writeBag(what);
  EXPECT_NE(run().out.find("verdict"), std::string::npos);
  EXPECT_EQ(contents(out_ + "/summary.yaml").find("name: imu_clock_restart"), std::string::npos);
  const Outcome batch = run({"--set", "mode=batch"});
  EXPECT_EQ(batch.status, 0) << batch.err;
  what.jump_at = 8.0;
  // A gap that the odometry bridges is none.
  what.jump = 5.0;
  writeBag(what);
  EXPECT_EQ(run({"--set", "max_bridged_imu_gap=6"}).err, "");
}

TEST_F(BagRunner, ARunThatWaitsToStartAgainAtItsEndIsSaved) {
  BagContents what;
  what.duration = 9.0;
  what.jump = 5.0;  // at 8 s: too late for another start
  writeBag(what);
  const Outcome outcome = run();
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  const std::string yaml = contents(out_ + "/summary.yaml");
  for (const char* part : {"verdict: doubtful\n", "initialized_from: rest\n", "name: imu_clock_restart"})
    EXPECT_NE(yaml.find(part), std::string::npos) << part << yaml;
  EXPECT_NE(contents(out_ + "/trajectory_optimized.txt").find("\n1007.8"), std::string::npos);
}

TEST_F(BagRunner, TopicsOfABagWithoutLeadingSlashesAreFound) {
  writeBag({});
  {
    rosbag::Bag bag(bag_, rosbag::bagmode::Append);
    sensor_msgs::FluidPressure pressure;
    pressure.fluid_pressure = 101325.0;
    for (int k = 0; k < 400; ++k) {
      pressure.header.stamp = ros::Time(1000.0) + ros::Duration(0.02 * k);
      bag.write("sensor_platform/baro", pressure.header.stamp + ros::Duration(100.001), pressure);
    }
  }
  for (const char* topic : {"sensor_platform/baro", "/sensor_platform/baro"}) {
    const Outcome outcome = run({"--set", std::string("barometer_topic=") + topic});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(contents(out_ + "/summary.yaml").find("barometer: {pressures: 400,"), std::string::npos);
  }
}

TEST_F(BagRunner, APartOfTheBagCanBePlayed) {
  writeBag({});
  BagRun bag_run{{bag_}, out_, Config{}, nullptr};
  bag_run.config.bag_start = 1.0;
  bag_run.config.bag_duration = 5.0;
  const RunSummary summary = runBag(bag_run);
  EXPECT_NEAR(static_cast<double>(summary.imu_count), 1000.0, 2.0);
  EXPECT_NEAR(static_cast<double>(summary.scansTotal()), 50.0, 1.0);
  expectError(run({"--set", "bag_start=100"}), {"bag_start", "after its end"});
}

TEST_F(BagRunner, StartsInMotionWhereThereIsNoRest) {
  BagContents what;
  what.shaking = 1.0;
  writeBag(what);
  ASSERT_EQ(run().status, 0);
  const std::string summary = contents(out_ + "/summary.yaml");
  EXPECT_NE(summary.find("initialized_from: motion\n"), std::string::npos) << summary;
  EXPECT_NE(summary.find("health_at_end: ok\ndivergences: 0\nreinitializations: 0\n"), std::string::npos)
      << summary;
}

TEST_F(BagRunner, WithoutAFolderItPrintsTheSummary) {
  writeBag({});
  const Outcome outcome = runTool({bag_, "--config", "irs"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("verdict         good"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("--output-dir FOLDER writes them"), std::string::npos) << outcome.out;
  EXPECT_FALSE(fs::exists(out_));
}

TEST_F(BagRunner, HelpAndConfigurationNeedNoBag) {
  const Outcome help = runTool({"--help"});
  EXPECT_EQ(help.status, 0);
  for (const char* part : {"--output-dir", "Examples:", "rosrun rio_t rio_t_bag", "Exit status", "--version"})
    EXPECT_NE(help.out.find(part), std::string::npos) << part;
  EXPECT_EQ(runTool({"--fast", "-h"}).status, 0);
  EXPECT_EQ(runTool({"--version"}).out.rfind("rio_t_bag of rio_t ", 0), 0U);
  EXPECT_EQ(runTool({"--print-parameters"}).out, parametersMarkdown());
  const Outcome printed = runTool({"--print-config"});
  EXPECT_EQ(printed.status, 0);
  EXPECT_EQ(printed.out, toYaml(Config{}));
  EXPECT_NE(runTool({"--print-config", "--set", "window=2.0"}).out.find("\nwindow: 2.0\n"),
            std::string::npos);
}

TEST_F(BagRunner, EstimatedExtrinsicsAreWritten) {
  writeBag({});
  const Outcome outcome = run({"--set", "estimate_extrinsics=pose", "--set", "extrinsics_rotation_sigma=0.1",
                               "--set", "extrinsics_translation_sigma=0.02"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("turned by"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("moved by"), std::string::npos) << outcome.out;
  const std::string csv = contents(out_ + "/extrinsics.csv");
  EXPECT_EQ(csv.rfind("stamp,x,y,z,qx,qy,qz,qw,sigma_x,sigma_y,sigma_z,sigma_rx,sigma_ry,sigma_rz\n100", 0),
            0u);
  const std::string offsets = contents(out_ + "/time_offset.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), std::count(offsets.begin(), offsets.end(), '\n'));
  const std::string yaml = contents(out_ + "/summary.yaml");
  // At rest nothing shows where the radar is: it stays as told, and as unsure as told.
  for (const char* line : {"configured_extrinsics_translation: [0.030000000, 0.030000000, -0.060000000]\n",
                           "final_extrinsics_translation: [0.0", "final_extrinsics_translation_sigma: [0.0",
                           "final_extrinsics_rotation_xyzw: [0.69", "final_extrinsics_rotation_sigma: [0."}) {
    EXPECT_NE(yaml.find(line), std::string::npos) << line << yaml;
  }

  ASSERT_EQ(run({"--set", "estimate_extrinsics=rotation"}).status, 0);
  EXPECT_NE(contents(out_ + "/summary.yaml")
                .find("final_extrinsics_translation_sigma: [0.000000000, 0.000000000, 0.000000000]"),
            std::string::npos);
  const Outcome unmeasured = run({"--set", "extrinsics_translation=[]"});
  ASSERT_EQ(unmeasured.status, 0);
  EXPECT_NE(unmeasured.out.find("moved by"), std::string::npos) << unmeasured.out;
  EXPECT_EQ(unmeasured.out.find("turned by"), std::string::npos) << unmeasured.out;
  EXPECT_NE(contents(out_ + "/summary.yaml").find("final_extrinsics_translation_sigma: [0.5"),
            std::string::npos);
  ASSERT_EQ(run().status, 0);
  EXPECT_FALSE(fs::exists(out_ + "/extrinsics.csv"));
  EXPECT_EQ(contents(out_ + "/summary.yaml").find("extrinsics"), std::string::npos);
}

TEST(RunLog, APathIsAsLongAsWhatWasDriven) {
  const Config config;
  RunLog log(config, nullptr, {0.0}, false);
  const auto leave = [&](double seconds, double x) {
    ScanResult result;
    result.left_window.push_back(
        {Time::fromSeconds(seconds), Eigen::Vector3d(x, 0.0, 0.0), Eigen::Quaterniond::Identity()});
    log.addResult(result);
  };
  const auto length = [&] {
    RunSummary summary;
    summary.radars.emplace_back();
    log.fill(&summary);
    return summary.path_length_m;
  };
  leave(100.0, 0.0);
  leave(105.0, 4.0);
  EXPECT_NEAR(length(), 4.0, 1e-12) << "without scans a node comes every 5 s";
  log.startAgain();
  leave(105.1, 4.5);  // was still in the window
  leave(106.0, 0.0);
  leave(106.1, 0.25);
  EXPECT_NEAR(length(), 4.75, 1e-12) << "a step across a restart is no way";
}

TEST(RunOutput, NumbersAreFixed) {
  const auto fixed = [](double value, int decimals) {
    std::string text;
    appendFixed(&text, value, decimals);
    return text;
  };
  EXPECT_EQ(fixed(1.25, 3), "1.250");
  EXPECT_EQ(fixed(-0.0625, 4), "-0.0625");
  EXPECT_EQ(fixed(-1e-12, 6), "0.000000") << "no negative zero";
  EXPECT_EQ(fixed(0.9999999, 6), "1.000000");
  EXPECT_EQ(fixed(12.0, 0), "12");
  EXPECT_EQ(fixed(1e20, 2), "100000000000000000000.00");
  EXPECT_EQ(fixed(std::nan(""), 2), ".nan");
}

}  // namespace
}  // namespace rio_t
