// The bag of the real sensors.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <string>

#include "../src/ros/temporary_folder.h"
#include "rio_t/ros/bag/bag_runner.h"
#include "rio_t/ros/parameters/parameters.h"
#include "run_files.h"

namespace rio_t {
namespace {

class RealBag : public testing::Test {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("RIO_T_DATA_DIR");  // NOLINT(concurrency-mt-unsafe): nobody sets it
    bag_ = (folder != nullptr ? std::string(folder) : std::string(RIO_T_SOURCE_DIR) + "/../shared/data") +
           "/real/ti_mmwave_rospkg_demo.bag";
    if (!fs::exists(bag_)) GTEST_SKIP() << "the real bag is not here: " << bag_;
  }

  RunSummary play(const std::string& folder) const {
    const Config config = makeConfig(readParameterFile(findConfigFile("ti_mmwave")));
    return runBag({{bag_}, folder, config, nullptr});
  }

  const TemporaryFolder temporary_;
  const std::string out_ = temporary_.path();
  std::string bag_;
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
  const RunSummary batch = runBag({{bag_}, out_, config, nullptr});
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
