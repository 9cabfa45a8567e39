#include "rio_t/ros/parameters/ros_parameters.h"

#include <gtest/gtest.h>

namespace rio_t {
namespace {

XmlRpc::XmlRpcValue serverMap() {
  XmlRpc::XmlRpcValue map;
  map["publish_tf"] = false;
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
  EXPECT_EQ(config.odometry.T_IR.l_I, Eigen::Vector3d(0.0, 0.5, 1.0));
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

}  // namespace
}  // namespace rio_t
