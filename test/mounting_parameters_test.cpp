// The three ways to tell the rotation of T_IR, its lever arm, and the units of the IMU.
#include <gtest/gtest.h>

#include <fstream>

#include "rio_t/radar/mounting.h"
#include "rio_t/ros/messages/conversions.h"
#include "rio_t/ros/parameters/parameters.h"

namespace rio_t {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

Config from(const std::vector<std::string>& assignments) {
  ParameterEntries entries;
  for (const std::string& each : assignments) entries.push_back(parseAssignment(each));
  return makeConfig(entries);
}

std::string faultOf(const std::vector<std::string>& assignments) {
  try {
    from(assignments);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

const Quaterniond kAhead(std::sqrt(0.5), 0, 0, -std::sqrt(0.5));  // of x right, y forward, z up

TEST(MountingParameters, WordsAreTheQuaternion) {
  const Config kart = from({"mounting_yaw_pitch_roll_deg=[30, 22, 0]"});
  EXPECT_LT(kart.odometry.radar.T_IR.q_IR.angularDistance(
                Quaterniond(0.8501141, 0.1652454, -0.0954045, -0.4908136)),
            1e-6);
  EXPECT_LT(from({"mounting_yaw_pitch_roll_deg=[0, 0, 0]"}).odometry.radar.T_IR.q_IR.angularDistance(kAhead),
            1e-12);
  EXPECT_EQ(from({"mounting_yaw_pitch_roll_deg=[]"}).odometry.radar.T_IR.q_IR.w(), 1.0);
}

TEST(MountingParameters, TheWordsDoNotDependOnTheAxesOfTheCloud) {
  for (const std::string& preset : pointCloudPresets()) {
    const Config config = from({"radar_format=" + preset, "mounting_yaw_pitch_roll_deg=[0, 0, 0]"});
    EXPECT_LT(config.odometry.radar.T_IR.q_IR.angularDistance(kAhead), 1e-12) << preset;
  }
}

TEST(MountingParameters, ARotationOfTheCloudsOwnAxesIsTurnedForAllPresets) {
  // The cloud's own axes are those of the IMU, x forward, y left, z up, or x right, y forward, z up.
  for (const std::string& preset : pointCloudPresets()) {
    const Config config = from({"radar_format=" + preset, "extrinsics_axes=cloud"});
    const bool flu = pointCloudPreset(preset).axes == PointAxes::kForwardLeftUp;
    const Vector3d forward_I = config.odometry.radar.T_IR.q_IR * Vector3d::UnitY();
    EXPECT_LT((forward_I - (flu ? Vector3d(1, 0, 0) : Vector3d(0, 1, 0))).norm(), 1e-12) << preset;
    EXPECT_LT((config.odometry.radar.T_IR.q_IR * Vector3d::UnitZ() - Vector3d(0, 0, 1)).norm(), 1e-12)
        << preset;
  }
  // The same as from tf.
  geometry_msgs::Transform tf;
  tf.rotation.x = tf.rotation.y = tf.rotation.z = tf.rotation.w = 0.5;
  const Config config = from(
      {"radar_format=coloradar", "extrinsics_axes=cloud", "extrinsics_rotation_xyzw=[0.5, 0.5, 0.5, 0.5]"});
  EXPECT_LT(config.odometry.radar.T_IR.q_IR.angularDistance(toExtrinsics(tf, PointAxes::kForwardLeftUp).q_IR),
            1e-12);
}

TEST(MountingParameters, BothWaysAtOnceAreAFaultThatNamesBoth) {
  const std::string fault =
      faultOf({"mounting_yaw_pitch_roll_deg=[0, 0, 0]", "extrinsics_rotation_xyzw=[0, 0, 0, 1]"});
  EXPECT_NE(fault.find("mounting_yaw_pitch_roll_deg"), std::string::npos) << fault;
  EXPECT_NE(fault.find("extrinsics_rotation_xyzw"), std::string::npos) << fault;
  const std::string of_radar =
      faultOf({"radars=[left]", "left/mounting_yaw_pitch_roll_deg=[0, 0, 0]",
               "left/extrinsics_rotation_xyzw=[0, 0, 0, 1]", "left/radar_topic=/left"});
  EXPECT_NE(of_radar.find("left/mounting_yaw_pitch_roll_deg"), std::string::npos) << of_radar;
  EXPECT_EQ(faultOf({"mounting_yaw_pitch_roll_deg=[]", "extrinsics_rotation_xyzw=[0, 0, 0, 1]"}), "");
}

/// As a file with these lines, and the assignments on top.
Config fromFile(const std::string& lines, const std::vector<std::string>& assignments) {
  ParameterEntries entries = readParameters(lines, "my.yaml");
  for (const std::string& each : assignments) entries.push_back(parseAssignment(each));
  return makeConfig(entries);
}

double rollOf(const Config& config) {
  return mountingOf(configsOfRadars(config).front().odometry.radar.T_IR.q_IR).roll * 57.2957795;
}

TEST(MountingParameters, TheCommandLineReplacesTheMountingOfTheFileInEitherWay) {
  const std::string quaternion = "imu_topic: imu\nextrinsics_rotation_xyzw: [0.0, 0.0, 0.0, 1.0]\n";
  EXPECT_NEAR(rollOf(fromFile(quaternion, {"mounting_yaw_pitch_roll_deg=[0, 0, 180]"})), 180.0, 1e-6);
  EXPECT_EQ(fromFile(quaternion, {"mounting_yaw_pitch_roll_deg=[]"}).odometry.radar.T_IR.q_IR.w(), 1.0);
  const std::string words = "mounting_yaw_pitch_roll_deg: [0, 0, 180]\n";
  EXPECT_EQ(fromFile(words, {"extrinsics_rotation_xyzw=[0, 0, 0, 1]"}).odometry.radar.T_IR.q_IR.w(), 1.0);
  EXPECT_THROW(fromFile(quaternion + words, {}), ConfigError);
}

TEST(MountingParameters, TheCommandLineReplacesTheMountingOfASectionInEitherWay) {
  const std::string quaternion =
      "radars: [left]\nleft:\n  radar_topic: left\n  extrinsics_rotation_xyzw: [0, 0, 0, 1]\n";
  EXPECT_NEAR(rollOf(fromFile(quaternion, {"left/mounting_yaw_pitch_roll_deg=[0, 0, 180]"})), 180.0, 1e-6);
  const std::string words =
      "radars: [left]\nleft:\n  radar_topic: left\n  mounting_yaw_pitch_roll_deg: [0, 0, 180]\n";
  const Config config = fromFile(words, {"left/extrinsics_rotation_xyzw=[0, 0, 0, 1]"});
  EXPECT_EQ(config.odometry.radars.front().T_IR.q_IR.w(), 1.0);
}

TEST(MountingParameters, AMountingThatNoSourceGivesIsAWarning) {
  const auto warnings = [](const std::vector<std::string>& assignments) {
    return mountingWarnings(from(assignments));
  };
  ASSERT_EQ(warnings({"imu_topic=imu", "extrinsics_translation=[1, 0, 0]"}).size(), 1u);
  EXPECT_EQ(warnings({}).front(),
            "The configuration gives no mounting: the radar is taken to look along y of the IMU. Set "
            "mounting_yaw_pitch_roll_deg or extrinsics_rotation_xyzw.");
  EXPECT_EQ(warnings({"mounting_yaw_pitch_roll_deg=[]"}).size(), 1u);
  EXPECT_TRUE(warnings({"extrinsics_rotation_xyzw=[0, 0, 0, 1]"}).empty()) << "the identity is meant";
  EXPECT_TRUE(warnings({"mounting_yaw_pitch_roll_deg=[90, 0, 0]"}).empty());
  EXPECT_TRUE(warnings({"extrinsics_axes=cloud"}).empty());
  EXPECT_TRUE(warnings({"extrinsics_source=tf"}).empty());
  const std::vector<std::string> of_left =
      warnings({"radars=[left, right]", "left/radar_topic=left", "right/radar_topic=right",
                "right/mounting_yaw_pitch_roll_deg=[-30, 0, 0]"});
  ASSERT_EQ(of_left.size(), 1u);
  EXPECT_NE(of_left.front().find("left/mounting_yaw_pitch_roll_deg"), std::string::npos) << of_left.front();
}

EstimateExtrinsics estimated(const Config& config) { return config.odometry.smoother.estimate_extrinsics; }
double leverArmSigma(const OdometryOptions& options, std::size_t radar) {
  return options.ofRadar(radar).extrinsics_translation_sigma;
}

TEST(MountingParameters, ALeverArmThatNobodyMeasuredIsEstimated) {
  for (const std::string none : {"mode=online", "extrinsics_translation=[]"}) {
    EXPECT_EQ(estimated(from({none})), EstimateExtrinsics::kLeverArm);
    EXPECT_EQ(estimated(from({none, "estimate_extrinsics=rotation"})), EstimateExtrinsics::kPose);
    EXPECT_EQ(from({none}).odometry.radar.T_IR.l_I, Vector3d::Zero());
    EXPECT_EQ(leverArmSigma(from({none}).odometry, 0), 0.5);
    EXPECT_EQ(leverArmSigma(from({none, "extrinsics_translation_sigma=0.2"}).odometry, 0), 0.2);
  }
  const Config measured = from({"extrinsics_translation=[0, 0, 0]", "estimate_extrinsics=pose"});
  EXPECT_EQ(leverArmSigma(measured.odometry, 0), 0.05);
  EXPECT_EQ(estimated(from({"extrinsics_translation=[0, 0, 0]"})), EstimateExtrinsics::kNone);
  EXPECT_EQ(estimated(from({"extrinsics_translation=[0, 0, 0]", "estimate_extrinsics=rotation"})),
            EstimateExtrinsics::kRotation);
  EXPECT_EQ(estimated(from({"extrinsics_source=tf"})), EstimateExtrinsics::kNone) << "tf gives it";
  // makeConfig keeps what the user gave, so the user can edit a printed configuration.
  const std::string yaml = toYaml(from({"estimate_extrinsics=rotation"}));
  for (const char* line : {"\nextrinsics_translation: []\n", "\nestimate_extrinsics: rotation\n",
                           "\nextrinsics_translation_sigma: 0.0\n"})
    EXPECT_NE(yaml.find(line), std::string::npos) << line;
}

TEST(MountingParameters, AVehicleTakesNoRotationForExact) {
  const auto sigma = [](const Config& config) { return config.odometry.smoother.extrinsics_rotation_sigma; };
  const std::string arm = "extrinsics_translation=[0, 0, 0]", vehicle = "platform=ground_vehicle";
  const Config held = from({arm, vehicle});
  EXPECT_EQ(estimated(held), EstimateExtrinsics::kRotation);
  EXPECT_DOUBLE_EQ(sigma(held), M_PI / 180.0);
  EXPECT_EQ(estimated(from({vehicle})), EstimateExtrinsics::kPose);
  EXPECT_EQ(sigma(from({arm, vehicle, "extrinsics_rotation_sigma=0.001"})), 0.001);
  EXPECT_EQ(sigma(from({arm, vehicle, "estimate_extrinsics=rotation"})), 0.17) << "as the user says";
  const Config pair =
      from({arm, vehicle, "radars=[left, right]", "left/radar_topic=/left", "right/radar_topic=/right"});
  EXPECT_EQ(estimated(pair.radars[1]), EstimateExtrinsics::kRotation);
  EXPECT_DOUBLE_EQ(sigma(pair.radars[1]), M_PI / 180.0);
  for (const char* line : {"\nestimate_extrinsics: none\n", "\nextrinsics_rotation_sigma: 0.17\n"})
    EXPECT_NE(toYaml(held).find(line), std::string::npos) << line;
}

TEST(MountingParameters, AMissingLeverArmIsThatOfOneRadar) {
  const Config config = from({"radars=[left, right]", "left/radar_topic=/left", "right/radar_topic=/right",
                              "left/extrinsics_translation=[0.2, 0, 0]", "estimate_extrinsics=rotation"});
  // All radars share one mode. A tape measures the left lever arm to some centimetres.
  EXPECT_EQ(estimated(config), EstimateExtrinsics::kPose);
  EXPECT_EQ(estimated(config.radars[0]), EstimateExtrinsics::kPose);
  EXPECT_EQ(leverArmSigma(config.odometry, 0), 0.05);
  EXPECT_EQ(leverArmSigma(config.odometry, 1), 0.5);
}

TEST(MountingParameters, EachRadarHasItsOwn) {
  const Config config =
      from({"radars=[left, right, rear]", "mounting_yaw_pitch_roll_deg=[30, 0, 0]", "left/radar_topic=/left",
            "right/radar_topic=/right", "right/mounting_yaw_pitch_roll_deg=[-30, 0, 0]",
            "rear/radar_topic=/rear", "rear/extrinsics_rotation_xyzw=[0, 0, 0, 1]"});
  const auto yaw = [&](std::size_t k) {
    return mountingOf(config.odometry.radars[k].T_IR.q_IR).yaw * 57.2957795;
  };
  EXPECT_NEAR(yaw(0), 30.0, 1e-6);
  EXPECT_NEAR(yaw(1), -30.0, 1e-6);
  EXPECT_EQ(config.odometry.radars[2].T_IR.q_IR.w(), 1.0);
}

TEST(MountingParameters, WhatIsPrintedReadsBackAsTheSameRotation) {
  const Config config = from({"radar_format=coloradar", "mounting_yaw_pitch_roll_deg=[12, -34, 56]"});
  const Config back = makeConfig(readParameters(toYaml(config), "printed"));
  EXPECT_LT(back.odometry.radar.T_IR.q_IR.angularDistance(config.odometry.radar.T_IR.q_IR), 1e-9);
  EXPECT_EQ(toYaml(back), toYaml(config));
}

TEST(MountingParameters, WrongAnglesAreNamed) {
  EXPECT_NE(faultOf({"mounting_yaw_pitch_roll_deg=[0, 0]"}).find("list of 3"), std::string::npos);
  EXPECT_NE(faultOf({"mounting_yaw_pitch_roll_deg=[0, 0, 400]"}).find("at most 360"), std::string::npos);
  EXPECT_NE(faultOf({"extrinsics_axes=frd"}).find("one of rfu, cloud"), std::string::npos);
}

TEST(ImuUnitParameters, AMessageInGAndDegreesIsConverted) {
  const Config config = from({"imu_acceleration_unit=g", "imu_rate_unit=deg/s"});
  sensor_msgs::Imu message;
  message.header.stamp = ros::Time(1.0);
  message.linear_acceleration.z = 1.0;
  message.angular_velocity.x = 180.0;
  const ImuMeasurement imu = toImuMeasurement(message, "/imu", config.imu_units);
  EXPECT_NEAR(imu.acceleration.z(), 9.80665, 1e-12);
  EXPECT_NEAR(imu.angular_velocity.x(), 3.14159265358979, 1e-12);
  EXPECT_NE(faultOf({"imu_acceleration_unit=mg"}).find("one of m/s2, g"), std::string::npos);
}

}  // namespace
}  // namespace rio_t
