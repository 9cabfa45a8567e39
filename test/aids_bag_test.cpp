// Runs of bags with a barometer, and with the platform told.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "../src/ros/temporary_folder.h"
#include "rio_t/core/angle.h"
#include "rio_t/evaluation/trajectory.h"
#include "rio_t/ros/bag/bag_runner.h"
#include "rio_t/ros/bag/simulation_bag.h"
#include "rio_t/ros/messages/conversions.h"
#include "rio_t/ros/parameters/parameters.h"
#include "rio_t/simulation/motions.h"
#include "run_files.h"

namespace rio_t {
namespace {

class AidsBag : public testing::Test {
 protected:
  void SetUp() override {
    simulation::MotionRequest request;
    request.name = "drone";
    request.seed = 2;
    request.duration = 25.0;
    request.rest = {5.0, 0.0, 2.0};
    const simulation::Motion motion = simulation::makeMotion(request);
    simulation::SimulationOptions rig;
    rig.seed = 2;
    rig.barometer.enabled = true;
    simulation::SensorData data = simulation::simulate(motion, rig);
    writeSimulationBag(folder_ + "/pascal.bag", motion, data, rig.start, {});
    const std::vector<simulation::SimulatedPressure> pressures = data.pressures;
    for (simulation::SimulatedPressure& pressure : data.pressures) pressure.pascal *= 0.01;
    writeSimulationBag(folder_ + "/hectopascal.bag", motion, data, rig.start, {});
    data.pressures = pressures;
    const std::size_t frozen = pressures.size() / 3;
    for (std::size_t k = frozen; k < pressures.size(); ++k)
      data.pressures[k].pascal = pressures[frozen].pascal;
    writeSimulationBag(folder_ + "/frozen.bag", motion, data, rig.start, {});
  }

  /// A vehicle whose radar is tilted by 7 degrees more than the configuration says.
  void writeVehicle() const {
    simulation::MotionRequest request;
    request.name = "kart";
    request.seed = 1;
    request.duration = 40.0;
    request.rest = {4.0, 0.0, 2.0};
    const simulation::Motion motion = simulation::makeMotion(request);
    simulation::SimulationOptions rig;
    rig.seed = 1;
    rig.T_IR.q_IR = rig.T_IR.q_IR * Eigen::AngleAxisd(7.0 * kDegree, Eigen::Vector3d::UnitX());
    writeSimulationBag(folder_ + "/vehicle.bag", motion, simulation::simulate(motion, rig), rig.start, {});
  }

  RunSummary run(const std::string& bag, const ParameterEntries& entries) const {
    ParameterEntries all = readParameterFile(findConfigFile("irs"));
    all.insert(all.end(), entries.begin(), entries.end());
    return runBag({{folder_ + "/" + bag + ".bag"}, folder_ + "/out", makeConfig(all), nullptr});
  }
  std::string out(const std::string& name) const { return contents(folder_ + "/out/" + name); }

  TemporaryFolder temporary_;
  const std::string folder_ = temporary_.path();
};

ParameterEntries parse(const std::string& key, const std::string& value) {
  return {parseAssignment(key + "=" + value)};
}

TEST_F(AidsBag, TheMapOfLandmarksIsAccountedFor) {
  const RunSummary summary = run("pascal", parse("landmarks", "true"));
  ASSERT_TRUE(summary.landmarks.has_value());
  EXPECT_GT(summary.landmarks->scans, 150u);
  EXPECT_GT(summary.landmarks->scans_trusted, 0u);
  EXPECT_LT(summary.landmarks->scans_trusted, summary.landmarks->scans) << "at first it has no proof";
  EXPECT_GT(summary.landmarks->most_in_map, 10u);
  EXPECT_NE(out("summary.yaml").find("landmarks: {scans: "), std::string::npos);
  EXPECT_FALSE(run("pascal", {}).landmarks.has_value());
}

TEST_F(AidsBag, ABarometerIsReadAndAccountedFor) {
  const RunSummary summary = run("pascal", parse("barometer_topic", "/sensor_platform/baro"));
  ASSERT_TRUE(summary.barometer.has_value());
  EXPECT_EQ(summary.barometer->pressures, 1250u);
  EXPECT_GT(summary.barometer->used, 180u);  // ten a second after the start
  EXPECT_TRUE(summary.barometer->rejected.empty());
  EXPECT_TRUE(summary.warnings.empty());
  EXPECT_EQ(out("barometer.csv").rfind("stamp,height,innovation,innovation_sigma,bias,", 0), 0u);
  EXPECT_NE(out("summary.yaml").find("barometer: {pressures: 1250, means_used: "), std::string::npos);
  EXPECT_NE(out("summary.yaml").find("barometer.csv"), std::string::npos);
}

TEST_F(AidsBag, WithoutThemNoFileAndNoKeyIsThere) {
  run("pascal", parse("barometer_topic", "/sensor_platform/baro"));
  run("pascal", {});
  EXPECT_FALSE(fs::exists(folder_ + "/out/barometer.csv"));  // that of the run before is gone
  EXPECT_EQ(out("summary.yaml").find("barometer"), std::string::npos);
  EXPECT_EQ(out("summary.yaml").find("ground_vehicle"), std::string::npos);
}

TEST_F(AidsBag, PressuresInHectopascalAreTold) {
  const RunSummary summary = run("hectopascal", parse("barometer_topic", "/sensor_platform/baro"));
  EXPECT_EQ(summary.input_faults.at("pressure_not_usable"), 1250u);
  ASSERT_FALSE(summary.warnings.empty());
  EXPECT_NE(summary.warnings.front().find("/sensor_platform/baro: fluid_pressure: the pressure is 10"),
            std::string::npos)
      << summary.warnings.front();
  EXPECT_NE(summary.warnings.front().find("is it in hPa?"), std::string::npos);
  EXPECT_NE(summary.warnings.back().find("barometer_topic"), std::string::npos);
}

TEST_F(AidsBag, ABarometerThatFreezesIsTold) {
  const RunSummary summary = run("frozen", parse("barometer_topic", "/sensor_platform/baro"));
  EXPECT_GT(summary.barometer->steps, 0u);
  ASSERT_EQ(summary.warnings.size(), 1u);
  EXPECT_NE(summary.warnings.front().find("(barometer_topic) stepped"), std::string::npos);
  EXPECT_NE(summary.warnings.front().find("freezes"), std::string::npos);
}

TEST_F(AidsBag, ATopicThatIsNotThereIsAnError) {
  try {
    run("pascal", parse("barometer_topic", "/baro"));
    FAIL() << "expected an error";
  } catch (const std::exception& error) {
    EXPECT_NE(std::string(error.what()).find("no topic /baro (barometer_topic, sensor_msgs/FluidPressure)"),
              std::string::npos)
        << error.what();
  }
}

TEST_F(AidsBag, ADroneThatIsToldToBeAVehicleIsToldSo) {
  const RunSummary summary = run("pascal", parse("platform", "ground_vehicle"));
  ASSERT_TRUE(summary.ground_vehicle.has_value());
  ASSERT_TRUE(summary.ground_vehicle->contradicted_at.has_value());
  EXPECT_LT(*summary.ground_vehicle->contradicted_at, 10.0);
  ASSERT_EQ(summary.warnings.size(), 1u);
  EXPECT_NE(summary.warnings.front().find("s the motion contradicted platform: ground_vehicle"),
            std::string::npos);
  EXPECT_EQ(summary.input_faults.at("ground_vehicle_contradicted"), 1u);
  EXPECT_NE(out("summary.yaml").find("contradicted: true"), std::string::npos);
  EXPECT_NE(out("ground_vehicle.csv").find(",contradicted\n"), std::string::npos);
}

TEST_F(AidsBag, AVehicleKeepsItsHeightWithAMountingThatIsToldWrong) {
  writeVehicle();
  const RunSummary summary = run("vehicle", parse("platform", "ground_vehicle"));
  double height = 0.0;
  for (const StampedPose& pose : readTum(folder_ + "/out/trajectory.txt"))
    height = std::max(height, std::abs(pose.p_W.z()));
  EXPECT_LT(height, 0.2);
  EXPECT_EQ(summary.diagnosis.verdict, RunVerdict::kDoubtful);
  ASSERT_EQ(summary.diagnosis.causes.size(), 1u);
  const Cause& cause = summary.diagnosis.causes.front();
  EXPECT_EQ(cause.name, "mounting_far");
  EXPECT_NE(cause.text.find("none takes it to be right to 1 degrees"), std::string::npos) << cause.text;
  EXPECT_NE(cause.remedy.find("Set estimate_extrinsics: rotation"), std::string::npos) << cause.remedy;
}

}  // namespace
}  // namespace rio_t
