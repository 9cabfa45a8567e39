#pragma once

#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/PointCloud2.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "rio_t/core/angle.h"
#include "rio_t/ros/bag/bag_runner.h"
#include "rio_t/ros/bag/check_bag.h"
#include "rio_t/ros/bag/simulation_bag.h"
#include "rio_t/ros/parameters/parameters.h"
#include "rio_t/simulation/motions.h"
#include "rio_t/simulation/simulation.h"
#include "run_files.h"

namespace rio_t {

/// Changes a message; false leaves it out.
struct Changes {
  std::function<bool(sensor_msgs::Imu&)> imu = nullptr;
  std::function<bool(sensor_msgs::PointCloud2&)> cloud = nullptr;
  bool keep_triggers = false;
  int copies = 1;  // of each message
};

/// A simulated bag, changes to it, and what check_bag says of them.
class PlainBag : public testing::Test {
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
      const auto recordOf = [&](int copy) { return instance.getTime() + ros::Duration(1e-4 * copy); };
      if (const auto imu = instance.instantiate<sensor_msgs::Imu>()) {
        if (changes.imu && !changes.imu(*imu)) continue;
        for (int k = 0; k < changes.copies; ++k) out.write(instance.getTopic(), recordOf(k), *imu);
      } else if (const auto cloud = instance.instantiate<sensor_msgs::PointCloud2>()) {
        if (changes.cloud && !changes.cloud(*cloud)) continue;
        for (int k = 0; k < changes.copies; ++k) out.write(instance.getTopic(), recordOf(k), *cloud);
      } else if (changes.keep_triggers) {
        out.write(instance.getTopic(), instance.getTime(), instance);
      }
    }
    return path;
  }

  static BagCheck check(const std::string& bag, bool try_out = true,
                        const std::vector<std::string>& told = {}) {
    CheckRequest request;
    for (const std::string& assignment : told) request.set.push_back(parseAssignment(assignment));
    request.bags = {bag};
    request.try_out = try_out;
    return checkBag({bag}, request);
  }

  static Config configOf(const BagCheck& check) { return makeConfig(readParameters(check.yaml, "my.yaml")); }

  /// Runs the odometry with what was written, as a user would.
  static RunSummary run(const BagCheck& check) {
    BagRun bag_run;
    bag_run.bags = check.bags;
    bag_run.config = configOf(check);
    return runBag(bag_run);
  }

  static void expectRuns(const BagCheck& check) {
    ASSERT_TRUE(check.ready()) << describeCheck(check);
    const RunSummary summary = run(check);
    EXPECT_EQ(summary.divergences, 0u) << check.yaml;
    EXPECT_EQ(toString(summary.health), "ok") << check.yaml;
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
    return configOf(check).odometry.radar.T_IR.q_IR.angularDistance(setup_.T_IR.q_IR) / kDegree;
  }

  inline static std::string folder_, bag_;
  inline static simulation::SimulationOptions setup_;
};

}  // namespace rio_t
