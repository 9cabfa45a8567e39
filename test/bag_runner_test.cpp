#include "rio_t/ros/bag/bag_runner.h"

#include <geometry_msgs/PoseStamped.h>
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/point_cloud2_iterator.h>
#include <std_msgs/Header.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "rio_t/ros/bag/bag_tool.h"
#include "rio_t/ros/bag/simulation_bag.h"
#include "rio_t/simulation/motions.h"

namespace rio_t {
namespace {

namespace fs = std::filesystem;

std::string contents(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// The summary without the keys that time the run, which stand at its end.
std::string untimed(const std::string& summary) {
  return summary.substr(0, summary.find("estimation_seconds"));
}

struct Outcome {
  int status = 0;
  std::string out, err;
};

Outcome runTool(const std::vector<std::string>& words) {
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
  double shaking = 0.0;  ///< amplitude of the gyro [rad/s]
  std::string doppler_field = "v_doppler_mps";
  bool ground_truth = false;
  std::vector<std::string> radar_topics = {"/sensor_platform/radar/scan"};
};

/// A platform at rest with the IRS topics, recorded by a clock 100 s ahead.
class BagRunner : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        (fs::temp_directory_path() /
         ("rio_t_bag_runner_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name())))
            .string();
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    bag_ = folder_ + "/test.bag";
    out_ = folder_ + "/out";
  }
  void TearDown() override { fs::remove_all(folder_); }

  void writeBag(const BagContents& what) const {
    rosbag::Bag bag(bag_, rosbag::bagmode::Write);
    const int steps = static_cast<int>(what.duration * 200.0);
    for (int k = 0; k < steps; ++k) {
      const double t = 0.005 * k;
      const ros::Time stamp = ros::Time(1000.0) + ros::Duration(t);
      const ros::Time record = stamp + ros::Duration(100.001);
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

  /// One line on stderr that holds every part, and exit status 1.
  void expectError(const Outcome& outcome, const std::vector<std::string>& parts) const {
    EXPECT_EQ(outcome.status, 1);
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    for (const std::string& part : parts)
      EXPECT_NE(outcome.err.find(part), std::string::npos) << part << " not in: " << outcome.err;
  }

  std::string folder_, bag_, out_;
};

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

TEST_F(BagRunner, EveryScanIsAccountedFor) {
  writeBag({});
  BagRun bag_run{bag_, out_, Config{}, nullptr};
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
        "radar_doppler_step: 0.125", "radar_doppler_step_from: unknown\n", "radar_points_per_scan: {p10: ",
        "saved: [trajectory.txt", "estimation_seconds: ", "realtime_factor: "}) {
    EXPECT_NE(yaml.find(key), std::string::npos) << key;
  }
  EXPECT_EQ(yaml.find("ate_m"), std::string::npos);
}

TEST_F(BagRunner, TheDopplerStepIsToldWithItsSource) {
  RunSummary summary;
  const auto told = [&](double value, DopplerStepSource source, const char* in_summary,
                        const char* in_table) {
    summary.radars.front().doppler_step = {value, source};
    RunOutput(out_).finish(summary);
    EXPECT_NE(contents(out_ + "/summary.yaml").find(in_summary), std::string::npos) << in_summary;
    EXPECT_NE(describeRun(summary, out_).find(in_table), std::string::npos) << in_table;
  };
  told(0.125, DopplerStepSource::kUnknown, "radar_doppler_step: 0.125000\nradar_doppler_step_from: unknown\n",
       "not known");
  told(0.49, DopplerStepSource::kGiven, "radar_doppler_step: 0.490000\nradar_doppler_step_from: given\n",
       "0.490 m/s, given");
  told(0.0, DopplerStepSource::kData, "radar_doppler_step: 0.000000\nradar_doppler_step_from: data\n",
       "none, from the data");
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
        "solver_terminations: {converged: 1}\n", "scans_readmitted: 0\n", "\nate_m: 0.0"})
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

  expectError(run({"--set", "ground_truth=" + folder_ + "/none.txt"}), {folder_ + "/none.txt"});
  std::ofstream(folder_ + "/elsewhen.txt") << "5.0 0 0 0 0 0 0 1\n6.0 3 0 0 0 0 0 1\n";
  expectError(run({"--set", "ground_truth=" + folder_ + "/elsewhen.txt"}), {"ground truth", "elsewhen.txt"});
}

TEST_F(BagRunner, APartOfTheBagCanBePlayed) {
  writeBag({});
  BagRun bag_run{bag_, out_, Config{}, nullptr};
  bag_run.config.bag_start = 1.0;
  bag_run.config.bag_duration = 5.0;
  const RunSummary summary = runBag(bag_run);
  EXPECT_NEAR(static_cast<double>(summary.imu_count), 1000.0, 2.0);
  EXPECT_NEAR(static_cast<double>(summary.scansTotal()), 50.0, 1.0);
  expectError(run({"--set", "bag_start=100"}), {"bag_start", "behind its end"});
}

TEST_F(BagRunner, MissingBagFolderAndUnreadableBagAreNamed) {
  expectError(run(), {bag_, "no such file"});
  EXPECT_FALSE(fs::exists(out_));
  bag_ = folder_;
  expectError(run(), {folder_, "folder"});
  bag_ = folder_ + "/text.bag";
  std::ofstream(bag_) << "not a bag at all, but long enough to be looked at\n";
  expectError(run(), {bag_, "cannot be read as a ROS 1 bag"});
  std::ofstream(bag_, std::ios::trunc).close();
  expectError(run(), {bag_});
}

TEST_F(BagRunner, AnUnindexedBagIsToldToBeReindexed) {
  writeBag({});
  // A recording that was cut off has no index: its header says that the index starts at 0.
  std::string bytes = contents(bag_);
  const std::size_t at = bytes.find("index_pos=");
  ASSERT_NE(at, std::string::npos);
  for (std::size_t i = 0; i < 8; ++i) bytes[at + 10 + i] = 0;
  std::ofstream(bag_, std::ios::binary) << bytes;
  expectError(run(), {bag_, "rosbag reindex"});
}

TEST_F(BagRunner, ATruncatedOrDamagedBagIsNamed) {
  writeBag({});
  const std::string bytes = contents(bag_);
  std::ofstream(bag_, std::ios::binary) << bytes.substr(0, bytes.size() / 2);
  expectError(run(), {bag_});
  // Damage in the middle of the data.
  std::string damaged = bytes;
  for (std::size_t i = 0; i < 2000; ++i) damaged[bytes.size() / 2 + i] = static_cast<char>(i * 37);
  std::ofstream(bag_, std::ios::binary | std::ios::trunc) << damaged;
  const Outcome outcome = run();
  if (outcome.status != 0) expectError(outcome, {bag_});
}

TEST_F(BagRunner, MissingTopicsListThoseOfTheBag) {
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

TEST_F(BagRunner, WrongTypesAreNamed) {
  writeBag({});
  expectError(run({"--set", "radar_topic=/sensor_platform/imu"}),
              {"/sensor_platform/imu (radar_topic) is sensor_msgs/Imu", "expected sensor_msgs/PointCloud2"});
  expectError(run({"--set", "ground_truth_topic=/other"}),
              {"/other (ground_truth_topic) is std_msgs/Header"});
}

TEST_F(BagRunner, AWrongCloudFormatIsNamed) {
  BagContents what;
  what.doppler_field = "speed";
  writeBag(what);
  expectError(run(), {"/sensor_platform/radar/scan", "v_doppler_mps", "speed"});
  EXPECT_EQ(run({"--set", "radar_field_doppler=speed"}).status, 0);
}

TEST_F(BagRunner, ZeroStampsAreNamedWithTheOtherSources) {
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

TEST_F(BagRunner, ABadMessageAmongGoodOnesIsCountedAndSaid) {
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

TEST_F(BagRunner, NoDataInThePartPlayedIsNamed) {
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
}

TEST_F(BagRunner, NeverInitialisedSaysWhatItWaitedFor) {
  BagContents what;
  what.duration = 2.0;
  writeBag(what);
  expectError(run(), {"never initialised, waited for", "init_duration"});
  what.duration = 8.0;
  what.shaking = 1.0;
  writeBag(what);
  expectError(run({"--set", "init_mode=static"}), {"never initialised, waited for", "gyro"});
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

TEST_F(BagRunner, EveryScanRejectedSaysWhy) {
  BagContents what;
  what.points = 2;  // their Dopplers would count, see radar_factor
  writeBag(what);
  expectError(run({"--set", "radar_factor=velocity"}),
              {"every one of the 80 scans was rejected", "too_few_points"});
  EXPECT_FALSE(fs::exists(out_ + "/summary.yaml"));
  what.points = 0;
  writeBag(what);
  expectError(run(), {"every one of the 80 scans was rejected", "too_few_points"});
}

TEST_F(BagRunner, ASummaryOfAnEarlierRunDoesNotOutliveAFailure) {
  writeBag({});
  ASSERT_EQ(run().status, 0);
  ASSERT_TRUE(fs::exists(out_ + "/summary.yaml"));
  BagContents what;
  what.points = 0;
  writeBag(what);
  EXPECT_EQ(run().status, 1);
  EXPECT_FALSE(fs::exists(out_ + "/summary.yaml"));
}

TEST_F(BagRunner, WrongParametersAndArgumentsAreNamed) {
  writeBag({});
  expectError(run({"--set", "widnow=1"}), {"widnow", "window"});
  expectError(run({"--set", "window=fast"}), {"window", "finite number"});
  expectError(run({"--config", "isr"}), {"isr", "irs"});
  expectError(run({"--fast"}), {"unknown argument --fast"});
  expectError(run({"--set"}), {"--set", "expected a value"});
  expectError(run({"--bag="}), {"--bag", "expected a value"});
  expectError(runTool({"--config", "irs"}), {"missing argument --bag --output-dir"});
  expectError(runTool({}), {"missing argument --bag --config --output-dir"});
}

TEST_F(BagRunner, AnOutputFolderThatCannotBeIsNamed) {
  writeBag({});
  std::ofstream(folder_ + "/file") << "in the way";
  out_ = folder_ + "/file";
  expectError(run(), {"output folder", folder_ + "/file"});
  out_ = folder_ + "/file/below";
  expectError(run(), {"output folder", folder_ + "/file/below"});
}

TEST_F(BagRunner, HelpAndConfigurationNeedNoBag) {
  const Outcome help = runTool({"--help"});
  EXPECT_EQ(help.status, 0);
  EXPECT_NE(help.out.find("--output-dir"), std::string::npos);
  const Outcome printed = runTool({"--print-config"});
  EXPECT_EQ(printed.status, 0);
  EXPECT_EQ(printed.out, toYaml(Config{}));
  EXPECT_NE(runTool({"--print-config", "--set", "window=2.0"}).out.find("\nwindow: 2.0\n"),
            std::string::npos);
}

// --- Several radars ---

const std::vector<std::string> kTwoTopics = {"/left", "/right"};

class TwoRadars : public BagRunner {
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

TEST_F(TwoRadars, MissingTopicsAndWrongTypesNameTheirRadar) {
  BagContents what;
  what.radar_topics = {"/left"};
  writeBag(what);
  expectError(runTwo(), {"no topic /right (right/radar_topic, sensor_msgs/PointCloud2)"});
  expectError(
      runTwo({"--set", "right/radar_topic=/other", "--set", "left/stamp_source=trigger", "--set",
              "left/trigger_topic=/absent"}),
      {"topic /other (right/radar_topic) is std_msgs/Header", "no topic /absent (left/trigger_topic"});
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

TEST_F(TwoRadars, FilesOfAnEarlierRunAreNotTakenForItsOwn) {
  BagContents what;
  what.radar_topics = {"/left", "/right", "/sensor_platform/radar/scan"};
  writeBag(what);
  ASSERT_EQ(runTwo({"--set", "estimate_extrinsics=rotation"}).status, 0);
  EXPECT_TRUE(has("extrinsics_right.csv"));
  std::ofstream(out_ + "/time_offset_truth.csv") << "stamp,offset\n";  // somebody's own
  std::ofstream(out_ + "/notes.txt") << "somebody's own\n";
  ASSERT_EQ(run().status, 0);
  for (const char* name : {"time_offset_left.csv", "ego_velocity_right.csv", "extrinsics_left.csv"})
    EXPECT_FALSE(has(name)) << name;
  for (const char* name : {"time_offset.csv", "ego_velocity.csv", "time_offset_truth.csv", "notes.txt"})
    EXPECT_TRUE(has(name)) << name;
  ASSERT_EQ(runTwo().status, 0);
  EXPECT_FALSE(has("time_offset.csv"));
  EXPECT_FALSE(has("ego_velocity.csv"));
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
  for (const char* line : {"told_extrinsics_translation: [0.030000000, 0.030000000, -0.060000000]\n",
                           "final_extrinsics_translation: [0.0", "final_extrinsics_translation_sigma: [0.0",
                           "final_extrinsics_rotation_xyzw: [0.69", "final_extrinsics_rotation_sigma: [0."}) {
    EXPECT_NE(yaml.find(line), std::string::npos) << line << yaml;
  }

  ASSERT_EQ(run({"--set", "estimate_extrinsics=rotation"}).status, 0);
  EXPECT_NE(contents(out_ + "/summary.yaml")
                .find("final_extrinsics_translation_sigma: [0.000000000, 0.000000000, 0.000000000]"),
            std::string::npos);
  ASSERT_EQ(run().status, 0);
  EXPECT_FALSE(fs::exists(out_ + "/extrinsics.csv"));
  EXPECT_EQ(contents(out_ + "/summary.yaml").find("extrinsics"), std::string::npos);
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
    const RunSummary summary = runBag({bag_, out_, config, nullptr});
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
  const RunSummary summary = runBag({bag_, out_, config, nullptr});
  const auto error = [&](std::size_t k, const Extrinsics& truth) {
    return summary.radars.at(k).extrinsics->T_IR.q_IR.angularDistance(truth.q_IR);
  };
  EXPECT_LT(error(0, left_), 0.02);
  EXPECT_LT(error(1, right_), 0.02);
  EXPECT_NEAR(summary.radars[1].extrinsics->told.q_IR.angularDistance(right_.q_IR), 0.08, 1e-9);
  EXPECT_TRUE(summary.radars[1].extrinsics->translation_sigma.isZero());
  expectInSummary({"final_extrinsics_rotation_xyzw_left: [", "final_extrinsics_rotation_sigma_right: [0.0"});
}

TEST_F(TwoSimulatedRadars, SameBagSameBytes) {
  const Config config = this->config();
  runBag({bag_, out_ + "/a", config, nullptr});
  runBag({bag_, out_ + "/b", config, nullptr});
  for (const std::string& name : runFiles(config).names())
    EXPECT_EQ(untimed(contents(out_ + "/a/" + name)), untimed(contents(out_ + "/b/" + name))) << name;
}

TEST(RunOutput, NumbersAreFixedAndStampsExact) {
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
  std::string stamp;
  appendStamp(&stamp, Time::fromNanoseconds(1700000000000000007));
  EXPECT_EQ(stamp, "1700000000.000000007");
}

// --- The real sensors ---

class RealBag : public testing::Test {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("RIO_T_DATA_DIR");  // NOLINT(concurrency-mt-unsafe): nobody sets it
    bag_ = (folder != nullptr ? std::string(folder) : std::string(RIO_T_SOURCE_DIR) + "/../shared/data") +
           "/real/ti_mmwave_rospkg_demo.bag";
    if (!fs::exists(bag_)) GTEST_SKIP() << "the real bag is not here: " << bag_;
    out_ = (fs::temp_directory_path() / "rio_t_real_bag").string();
    fs::remove_all(out_);
  }
  void TearDown() override { fs::remove_all(out_); }

  RunSummary play(const std::string& folder) const {
    const Config config = makeConfig(readParameterFile(findConfigFile("ti_mmwave")));
    return runBag({bag_, folder, config, nullptr});
  }

  std::string bag_, out_;
};

TEST_F(RealBag, TriggerStampsEndWhereTheyStarted) {
  const RunSummary summary = play(out_);
  EXPECT_EQ(summary.imu_count, 8270u);
  EXPECT_EQ(summary.scansTotal(), 412u);
  EXPECT_LE(summary.end_to_start_2d_m, 0.10);
  EXPECT_LE(summary.end_to_start_3d_m, 1.65);  // the published rotation is tilted
  EXPECT_GT(summary.radars.front().final_offset_s, -0.020);
  EXPECT_LT(summary.radars.front().final_offset_s, 0.0);
  EXPECT_GT(summary.radars.front().final_offset_sigma_s, 0.0);
  EXPECT_LT(summary.radars.front().final_offset_sigma_s, 0.020);
}

TEST_F(RealBag, NearlyEveryScanOfTheWalkIsUsed) {
  play(out_);
  // Walking from 13.5 s to 33.5 s.
  std::ifstream csv(out_ + "/ego_velocity.csv");
  std::string line;
  std::getline(csv, line);
  int walking = 0, used = 0;
  double first = 0.0;
  while (std::getline(csv, line)) {
    const double stamp = std::stod(line);
    if (first == 0.0) first = stamp;
    if (stamp - first < 13.5 || stamp - first > 33.5) continue;
    const std::string status = line.substr(line.rfind(',') + 1);
    ++walking;
    if (status == "moving" || status == "zero_velocity") ++used;
  }
  EXPECT_GE(walking, 190);
  EXPECT_GE(used, 0.95 * walking);
}

TEST_F(RealBag, OnlineEndsNearTheBatch) {
  Config config = makeConfig(readParameterFile(findConfigFile("ti_mmwave")));
  config.mode = RunMode::kBatch;
  const RunSummary batch = runBag({bag_, out_, config, nullptr});
  const RunSummary online = play(out_ + "/again");
  ASSERT_TRUE(batch.batch.has_value());
  EXPECT_TRUE(batch.batch->converged);
  EXPECT_NEAR(online.radars.front().final_offset_s, batch.radars.front().final_offset_s,
              0.3 * online.radars.front().final_offset_sigma_s);
  EXPECT_NEAR(online.end_to_start_2d_m, batch.end_to_start_2d_m, 0.05);
  EXPECT_NEAR(online.end_to_start_3d_m, batch.end_to_start_3d_m, 0.05);
}

TEST_F(RealBag, SameBytesTwice) {
  play(out_ + "/a");
  play(out_ + "/b");
  for (const std::string& name : RunFiles{}.names()) {
    const std::string a = contents(out_ + "/a/" + name), b = contents(out_ + "/b/" + name);
    EXPECT_FALSE(a.empty()) << name;
    EXPECT_EQ(untimed(a), untimed(b)) << name;
  }
}

}  // namespace
}  // namespace rio_t
