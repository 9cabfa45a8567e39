#include "rio_t/ros/parameters/ros_parameters.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "rio_t/radar/mounting.h"

namespace rio_t {
namespace {

XmlRpc::XmlRpcValue serverMap() {
  XmlRpc::XmlRpcValue map;
  map["publish_tf"] = XmlRpc::XmlRpcValue(false);
  map["max_iterations"] = 9;
  map["window"] = 2;  // the server holds a whole number where the YAML had none after the point
  map["gravity"] = 9.805;
  map["imu_topic"] = std::string("/my/imu");
  for (int k = 0; k < 3; ++k) map["extrinsics_translation"][k] = 0.5 * k;
  map["diagnostic_period"] = 2.0;  // diagnostic_updater's
  return map;
}

TEST(RosParameters, EveryTypeReachesTheConfiguration) {
  XmlRpc::XmlRpcValue map = serverMap();
  const Config config = makeConfig(toParameterEntries(map, "/rio_t"));
  EXPECT_FALSE(config.publish_tf);
  EXPECT_EQ(config.odometry.smoother.max_iterations, 9);
  EXPECT_EQ(config.odometry.smoother.window, 2.0);
  EXPECT_EQ(config.odometry.gravity, 9.805);
  EXPECT_EQ(config.imu_topic, "/my/imu");
  EXPECT_EQ(config.odometry.radar.T_IR.l_I, Eigen::Vector3d(0.0, 0.5, 1.0));
}

TEST(RosParameters, AListOfTheCommandLineArrivesAsText) {
  XmlRpc::XmlRpcValue map = serverMap();  // rosrun rio_t rio_t_node _key:=[0,0,180]
  map["mounting_yaw_pitch_roll_deg"] = std::string("[0,0,180]");
  map["radars"] = std::string("[left]");
  map["left"]["radar_topic"] = std::string("/left");
  map["left"]["extrinsics_translation"] = std::string("[1, 2.5, 3e-1]");
  map["trajectory_file"] = std::string("[1].txt");  // a text stays one
  const Config config = makeConfig(toParameterEntries(map, "/rio_t"));
  EXPECT_NEAR(std::abs(mountingOf(config.radars.front().odometry.radar.T_IR.q_IR).roll), M_PI, 1e-9);
  EXPECT_EQ(config.radars.front().odometry.radar.T_IR.l_I, Eigen::Vector3d(1.0, 2.5, 0.3));
  EXPECT_EQ(config.trajectory_file, "[1].txt");

  XmlRpc::XmlRpcValue broken;
  broken["mounting_yaw_pitch_roll_deg"] = std::string("[0,0");
  try {
    makeConfig(toParameterEntries(broken, "/rio_t"));
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("got \"[0,0\""), std::string::npos) << error.what();
  }
}

TEST(RosParameters, TheServerReplacesTheMountingOfTheFileInEitherWay) {
  ParameterEntries entries = readParameters("extrinsics_rotation_xyzw: [0, 0, 0, 1]\n", "my.yaml");
  XmlRpc::XmlRpcValue map;
  for (int k = 0; k < 3; ++k) map["mounting_yaw_pitch_roll_deg"][k] = 60 * k;
  for (ParameterEntry& entry : toParameterEntries(map, "/rio_t")) entries.push_back(std::move(entry));
  EXPECT_NEAR(mountingOf(makeConfig(entries).odometry.radar.T_IR.q_IR).roll, 2.0 / 3.0 * M_PI, 1e-9);
}

TEST(RosParameters, FaultsNameTheParameterWithItsNamespace) {
  XmlRpc::XmlRpcValue map = serverMap();
  map["windou"] = 1.0;
  map["gravity"] = std::string("heavy");
  map["radar"]["nested"] = 1;
  try {
    makeConfig(toParameterEntries(map, "/rio_t"));
    FAIL();
  } catch (const ConfigError& error) {
    ASSERT_EQ(error.faults().size(), 3U) << error.what();
    const std::string text = error.what();
    EXPECT_NE(text.find("parameter /rio_t/windou"), std::string::npos) << text;
    EXPECT_NE(text.find("parameter /rio_t/gravity"), std::string::npos) << text;
    EXPECT_NE(text.find("parameter /rio_t/radar"), std::string::npos) << text;
  }
}

TEST(RosParameters, FaultsOfTheServerSayHowToRemoveWhatAnEarlierRunLeft) {
  const ConfigError error = withHintOfServer(
      ConfigError({"parameter /rio_t/left/windou: unknown", "own.yaml:1: unknown"}), "/rio_t");
  EXPECT_EQ(error.faults(),
            (std::vector<std::string>{"parameter /rio_t/left/windou: unknown (perhaps left by an "
                                      "earlier run: rosparam delete /rio_t)",
                                      "own.yaml:1: unknown"}));
}

TEST(RosParameters, WhatANodeShowsIsTheConfigurationItRan) {
  XmlRpc::XmlRpcValue map = serverMap();
  map["radars"][0] = std::string("left");
  map["radars"][1] = std::string("right");
  map["right"]["radar_min_range"] = 1.5;
  map["radar_topic"] = std::string("/left");  // the section of left is empty
  map["right"]["radar_topic"] = std::string("/right");
  const Config config = makeConfig(toParameterEntries(map, "/rio_t"));
  XmlRpc::XmlRpcValue shown = toXmlRpc(readParameters(toYaml(config), "shown"));
  EXPECT_EQ(toYaml(makeConfig(toParameterEntries(shown, "/rio_t/effective"))), toYaml(config));
  EXPECT_EQ(static_cast<double&>(shown["right"]["radar_min_range"]), 1.5);
  EXPECT_EQ(shown["left"].getType(), XmlRpc::XmlRpcValue::TypeStruct);
  EXPECT_EQ(toXmlRpc({}).getType(), XmlRpc::XmlRpcValue::TypeStruct);
}

TEST(RosParameters, WhatAnEarlierRunShowedIsNotRead) {
  XmlRpc::XmlRpcValue map = serverMap();
  map["effective"]["gravity"] = 9.7;
  map["effective"]["left_over"] = XmlRpc::XmlRpcValue(true);
  EXPECT_EQ(makeConfig(toParameterEntries(map, "/rio_t")).odometry.gravity, 9.805);
}

TEST(RosParameters, NamespacesAreTheSectionsOfRadars) {
  XmlRpc::XmlRpcValue map = serverMap();
  map["radars"][0] = std::string("left");
  map["radars"][1] = std::string("right");
  map["left"]["radar_topic"] = std::string("/left");
  map["right"]["radar_topic"] = std::string("/right");
  map["right"]["radar_min_range"] = 1;
  for (int k = 0; k < 3; ++k) map["right"]["extrinsics_translation"][k] = 1.0 + k;
  const std::vector<Config> radars = configsOfRadars(makeConfig(toParameterEntries(map, "/rio_t")));
  ASSERT_EQ(radars.size(), 2U);
  EXPECT_EQ(radars[0].radar_topic, "/left");
  EXPECT_EQ(radars[0].odometry.radar.T_IR.l_I, Eigen::Vector3d(0.0, 0.5, 1.0));
  EXPECT_EQ(radars[1].radar_topic, "/right");
  EXPECT_EQ(radars[1].odometry.radar.ego_velocity.min_range, 1.0);
  EXPECT_EQ(radars[1].odometry.radar.T_IR.l_I, Eigen::Vector3d(1.0, 2.0, 3.0));
}

TEST(RosParameters, FaultsInASectionNameItsNamespace) {
  XmlRpc::XmlRpcValue map;
  map["radars"][0] = std::string("left");
  map["left"]["radar_min_range"] = std::string("near");
  map["left"]["window"] = 1.0;
  map["left"]["radar_topic"]["deeper"] = 1.0;
  try {
    makeConfig(toParameterEntries(map, "/rio_t"));
    FAIL();
  } catch (const ConfigError& error) {
    ASSERT_EQ(error.faults().size(), 3U) << error.what();
    const std::string text = error.what();
    EXPECT_NE(text.find("parameter /rio_t/left/radar_min_range: left/radar_min_range: expected"),
              std::string::npos)
        << text;
    EXPECT_NE(text.find("parameter /rio_t/left/window: left/window: window holds for all"), std::string::npos)
        << text;
    EXPECT_NE(text.find("parameter /rio_t/left/radar_topic"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace rio_t
