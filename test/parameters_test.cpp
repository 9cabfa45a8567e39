#include "rio_t/ros/parameters/parameters.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <stdexcept>
#include <tuple>

#include "../src/ros/temporary_folder.h"
#include "parameter_faults.h"
#include "rio_t/odometry/radar_inertial_odometry.h"
#include "rio_t/simulation/presets.h"
#include "run_files.h"

namespace rio_t {
namespace {

const std::string kConfigFolder = std::string(RIO_T_SOURCE_DIR) + "/config";

TEST(Parameters, EveryKindOfValueIsRead) {
  const Config config =
      fromAssignments({"window=2", "max_iterations=9", "estimate_time_offset=false", "imu_topic=/imu",
                       "stamp_source=arrival", "time_offset_model=imu",
                       "ground_truth=", "extrinsics_translation=[1, -2.5, 3e-1]", "time_offset_noise=1e-4"});
  EXPECT_EQ(config.odometry.smoother.window, 2.0);
  EXPECT_EQ(config.odometry.smoother.max_iterations, 9);
  EXPECT_FALSE(config.odometry.smoother.estimate_time_offset);
  EXPECT_EQ(config.imu_topic, "/imu");
  EXPECT_EQ(config.stamp_source, StampSource::kArrival);
  EXPECT_EQ(config.odometry.smoother.time_offset_model, TimeOffsetModel::kImu);
  EXPECT_EQ(config.odometry.radar.T_IR.l_I, Eigen::Vector3d(1.0, -2.5, 0.3));
  EXPECT_EQ(config.odometry.smoother.time_offset_noise, 1e-4);
}

/// Keys that no other test sets, each with a value that is not its default.
TEST(Parameters, EachOfTheseKeysSetsItsMember) {
  Config c;
  OdometryOptions& o = c.odometry;
  EgoVelocityOptions& radar = o.radar.ego_velocity;
  SmootherOptions& smoother = o.smoother;
  const std::vector<std::tuple<const char*, double, const double*>> numbers = {
      {"extrinsics_rotation_noise", 2e-5, &smoother.extrinsics_rotation_noise},
      {"extrinsics_translation_noise", 3e-5, &smoother.extrinsics_translation_noise},
      {"imu_gyro_scale_error", 0.01, &o.imu_noise.gyro_scale_error},
      {"max_imu_gap", 0.05, &o.max_imu_gap},
      {"imu_jump_patience", 0.6, &o.imu_input_check.jump_patience},
      {"imu_accel_range", 78.0, &o.imu_input_check.accel_range},
      {"imu_gyro_range", 17.0, &o.imu_input_check.gyro_range},
      {"imu_unseen_accel_density", 3.0, &o.imu_input_check.unseen_accel_density},
      {"imu_unseen_gyro_density", 0.7, &o.imu_input_check.unseen_gyro_density},
      {"max_radar_gap", 0.8, &o.max_radar_gap},
      {"init_motion_after", 6.0, &o.init_motion_after},
      {"init_duration", 4.0, &o.initialization.duration},
      {"init_max_gyro_std", 0.06, &o.initialization.max_gyro_std},
      {"init_max_accel_std", 0.7, &o.initialization.max_accel_std},
      {"init_max_gyro_mean", 0.2, &o.initialization.max_gyro_mean},
      {"init_max_gravity_error", 0.9, &o.initialization.max_gravity_error},
      {"init_motion_window", 3.5, &o.motion_initialization.window},
      {"init_motion_max_gravity_error", 2.5, &o.motion_initialization.max_gravity_error},
      {"init_motion_max_outlier_fraction", 0.4, &o.motion_initialization.max_outlier_fraction},
      {"init_motion_sigma_gyro_bias", 0.02, &o.motion_initialization.sigma_gyro_bias},
      {"init_motion_sigma_accel_bias", 0.3, &o.motion_initialization.sigma_accel_bias},
      {"rest_window", 0.6, &o.rest.window},
      {"rest_max_gyro_std", 0.02, &o.rest.max_gyro_std},
      {"rest_max_accel_std", 0.3, &o.rest.max_accel_std},
      {"rest_max_rate", 0.004, &o.rest.max_rate},
      {"rest_max_accel_error", 0.4, &o.rest.max_accel_error},
      {"rest_max_speed", 0.7, &o.rest.max_speed},
      {"rest_velocity_sigma", 0.03, &o.rest.velocity_sigma},
      {"vehicle_frame_rotation_sigma", 0.03, &o.ground_vehicle.rotation_sigma},
      {"vehicle_start_slope_sigma", 0.005, &o.ground_vehicle.start_slope_sigma},
      {"vehicle_frame_rotation_noise", 4e-5, &o.ground_vehicle.rotation_noise},
      {"vehicle_sideways_sigma", 0.06, &o.ground_vehicle.sideways_sigma},
      {"vehicle_vertical_sigma", 0.07, &o.ground_vehicle.vertical_sigma},
      {"vehicle_gate", 5.0, &o.ground_vehicle.gate},
      {"barometer_noise_density", 0.06, &o.barometer.noise_density},
      {"barometer_drift", 0.007, &o.barometer.drift},
      {"barometer_temperature", 25.0, &o.barometer.temperature},
      {"barometer_gate", 5.0, &o.barometer.gate},
      {"barometer_gate_timeout", 2.0, &o.barometer.gate_timeout},
      {"barometer_gate_slope", 0.08, &o.barometer.gate_slope},
      {"radar_max_azimuth", 1.1, &radar.max_azimuth},
      {"radar_max_elevation", 1.2, &radar.max_elevation},
      {"zero_velocity_threshold", 0.1, &radar.zero_velocity_threshold},
      {"zero_velocity_outlier_fraction", 0.35, &radar.zero_velocity_outlier_fraction},
      {"zero_velocity_sigma", 0.05, &radar.zero_velocity_sigma},
      {"ransac_inlier_threshold", 0.2, &radar.ransac_inlier_threshold},
      {"ego_velocity_prior_gate", 5.0, &radar.prior_gate},
      {"ego_velocity_min_inlier_fraction", 0.5, &radar.min_inlier_fraction},
      {"ego_velocity_prior_min_inlier_fraction", 0.25, &radar.prior_min_inlier_fraction},
      {"radar_azimuth_sigma", 0.04, &radar.azimuth_sigma},
      {"radar_elevation_sigma", 0.06, &radar.elevation_sigma},
      {"radar_doppler_sigma", 0.07, &radar.doppler_sigma},
      {"ego_velocity_max_condition_number", 900.0, &radar.max_condition_number},
      {"ego_velocity_max_sigma", 0.6, &radar.max_sigma},
      {"time_offset_min_acceleration", 0.3, &smoother.time_offset_min_acceleration},
      {"time_offset_step_memory", 9.0, &o.offset_step_detector.memory},
      {"time_offset_step_significance", 7.0, &o.offset_step_detector.significance},
      {"time_offset_step_min", 0.006, &o.offset_step_detector.min_change},
      {"huber_threshold", 2.0, &smoother.huber_threshold},
      {"innovation_model_error", 0.2, &o.innovation_gate.model_error},
      {"innovation_gate_timeout", 3.5, &o.innovation_gate.timeout},
      {"prior_sigma_yaw", 0.002, &smoother.prior_sigma_yaw},
      {"prior_sigma_position", 0.003, &smoother.prior_sigma_position},
      {"prior_sigma_velocity", 0.04, &smoother.prior_sigma_velocity},
      {"prior_sigma_gyro_bias", 8e-5, &smoother.prior_sigma_gyro_bias},
      {"prior_sigma_accel_bias", 0.2, &smoother.prior_sigma_accel_bias},
      {"reinitialize_after", 6.0, &o.health.reinitialize_after},
      {"divergence_window", 3.0, &o.health.window},
      {"divergence_max_contradiction", 0.7, &o.health.max_contradiction},
      {"divergence_max_velocity_sigma", 2.0, &o.health.max_velocity_sigma},
      {"coasting_after", 1.5, &o.health.coasting_after},
      {"radar_range_sigma", 0.06, &o.landmarks.range_sigma},
      {"tf_rate", 40.0, &c.tf_rate},
  };
  for (const auto& [key, value, member] : numbers) {
    EXPECT_NE(*member, value) << key;
    c = fromAssignments({std::string(key) + "=" + ParameterValue{value}.yaml()});
    EXPECT_EQ(*member, value) << key;
  }
  c = fromAssignments(
      {"radar_coordinates=spherical", "radar_field_azimuth=a", "radar_field_elevation=e",
       "radar_field_range=r", "rest_enabled=false", "vehicle_frame_translation=[0.1, 0.2, 0.3]",
       "ransac_seed=7", "ego_velocity_min_inliers=6", "ego_velocity_solver=ls",
       "time_offset_step_detection=false", "max_queued_scans=60", "on_divergence=report", "landmarks_max=25",
       "base_extrinsics_source=tf", "publish_tf=false", "invert_tf=true", "correct_stamps=false"});
  EXPECT_EQ(c.radar_overrides.coordinates, PointCoordinates::kSpherical);
  EXPECT_EQ(c.radar_overrides.azimuth, "a");
  EXPECT_EQ(c.radar_overrides.elevation, "e");
  EXPECT_EQ(c.radar_overrides.range, "r");
  EXPECT_FALSE(o.rest.enabled);
  EXPECT_EQ(o.ground_vehicle.T_IV.l_I, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(radar.ransac_seed, 7u);
  EXPECT_EQ(radar.min_inliers, 6u);
  EXPECT_EQ(radar.solver, EgoVelocitySolver::kLeastSquares);
  EXPECT_FALSE(o.offset_step_detector.enabled);
  EXPECT_EQ(o.max_queued_scans, 60u);
  EXPECT_EQ(o.health.on_divergence, OnDivergence::kReport);
  EXPECT_EQ(o.landmarks.max_landmarks, 25u);
  EXPECT_EQ(c.base_extrinsics_source, BaseExtrinsicsSource::kTf);
  EXPECT_FALSE(c.publish_tf);
  EXPECT_TRUE(c.publish_radar_tf);
  EXPECT_TRUE(c.invert_tf);
  EXPECT_FALSE(c.correct_stamps);
}

TEST(Parameters, WholeNumbersMayBeWrittenWithAPoint) {
  EXPECT_EQ(fromAssignments({"max_iterations=9.0"}).odometry.smoother.max_iterations, 9);
  EXPECT_EQ(fromAssignments({"path_max_poses=1500.0"}).path_max_poses, 1500u);
  for (const char* refused : {"max_iterations=9.5", "max_iterations=0.0", "max_iterations=99999999999.0"})
    EXPECT_TRUE(contains(faultOf(refused), "expected a whole number")) << refused;
}

TEST(Parameters, FramesAreKeptWithoutTheSlashThatTf2Refuses) {
  const Config config =
      fromAssignments({"odom_frame=/odom", "base_link_frame=/base", "radar_frame=/my/radar"});
  EXPECT_EQ(config.odom_frame, "odom");
  EXPECT_EQ(config.base_link_frame, "base");
  EXPECT_EQ(config.radar_frame, "my/radar");
  EXPECT_TRUE(contains(faultOf("odom_frame=/"), "odom_frame: expected one line of text, not empty"));
  EXPECT_TRUE(contains(faultsOf({"odom_frame=/map", "base_link_frame=map"}).at(0), "got \"map\" for both"));
}

TEST(Parameters, TheKeysThatUsersRelyOnExist) {
  std::set<std::string> keys;
  for (const ParameterDescription& about : parameterDescriptions()) {
    EXPECT_TRUE(keys.insert(about.key).second) << about.key << " twice";
    EXPECT_FALSE(about.description.empty()) << about.key;
    EXPECT_FALSE(about.expected.empty()) << about.key;
  }
  for (const char* key : {"estimate_time_offset", "stamp_source", "radar_stamp_shift", "bag_start",
                          "bag_duration", "ground_truth", "time_offset_model", "window", "max_time_offset",
                          "time_offset_initial", "time_offset_sigma", "time_offset_noise"}) {
    EXPECT_EQ(keys.count(key), 1u) << key;
  }
}

TEST(Parameters, LaterEntriesHold) {
  EXPECT_EQ(fromAssignments({"window=2.0", "window=3.0"}).odometry.smoother.window, 3.0);
}

TEST(Parameters, WrongTypesAreNamedWithWhatWasExpected) {
  EXPECT_EQ(faultOf("window=fast"),
            "--set: window: expected a finite number above 0 and at most 60 [s], got \"fast\"");
  EXPECT_TRUE(contains(faultOf("window=\"1.0\""), "expected a finite number"));
  EXPECT_TRUE(contains(faultOf("window="), "got nothing"));
  EXPECT_TRUE(contains(faultOf("window=[1.0]"), "got [1]"));
  EXPECT_TRUE(contains(faultOf("window={a: 1}"), "got nested keys"));
  EXPECT_TRUE(contains(faultOf("max_iterations=2.5"), "expected a whole number"));
  EXPECT_TRUE(contains(faultOf("estimate_time_offset=1"), "expected true or false, got 1"));
  EXPECT_TRUE(contains(faultOf("imu_topic=3"), "expected one line of text, not empty, got 3"));
  EXPECT_TRUE(contains(faultOf("imu_topic=\"\""), "expected one line of text, not empty, got \"\""));
  EXPECT_TRUE(contains(faultOf("extrinsics_translation=[1, 2]"), "expected [], or a list of 3 finite"));
  EXPECT_TRUE(contains(faultOf("extrinsics_translation=[1, 2, x]"), "expected [], or a list of 3 finite"));
  EXPECT_TRUE(contains(faultOf("extrinsics_translation=1"), "expected [], or a list of 3 finite"));
  EXPECT_TRUE(contains(faultOf("base_extrinsics_translation=1"), "expected a list of 3 finite numbers"));
}

TEST(Parameters, ListsInListsAndListsThatHoldThemselvesAreRefused) {
  EXPECT_TRUE(contains(faultOf("extrinsics_translation=[[1, 2, 3], 0, 0]"), "got [nested keys, 0, 0]"));
  EXPECT_TRUE(contains(faultOf("extrinsics_translation=&x [*x, 0, 0]"), "got [nested keys, 0, 0]"));
}

TEST(Parameters, LongTextIsReadLikeShort) {
  const std::string digits(1000000, '1');
  EXPECT_TRUE(contains(faultOf("window=" + digits), "expected a finite number"));
  EXPECT_TRUE(contains(faultOf("window=" + digits + "x"), "expected a finite number"));
  EXPECT_TRUE(contains(faultOf(digits + "=1"), "unknown parameter"));
}

TEST(Parameters, TextIsOneLine) {
  EXPECT_TRUE(contains(faultOf("imu_topic=\"/imu\\n/other\""), "expected one line of text"));
  EXPECT_TRUE(contains(faultOf("ground_truth=\"a\\0b\""), "expected one line of text"));
  EXPECT_EQ(fromAssignments({"ground_truth=\"größe\""}).ground_truth, "größe");
}

TEST(Parameters, NumbersAreToldFromTextLikeIt) {
  const auto isNumber = [](const std::string& text) {
    const ParameterValue value = parsePlainScalar(text);
    return std::holds_alternative<double>(value.data) || std::holds_alternative<std::int64_t>(value.data);
  };
  for (const char* text : {"0", "-1", "+1", "1.", ".5", "-.5", "1.5e3", "1E-3", "1.e+3", ".5e0"})
    EXPECT_TRUE(isNumber(text)) << text;
  for (const char* text : {"-", ".", "-.", "e3", ".e3", "1e", "1e+", "1.5e3.0", "1 2", "0x10", "1,5", "--1"})
    EXPECT_FALSE(isNumber(text)) << text;
}

TEST(Parameters, ValuesOutOfRangeAreRefused) {
  EXPECT_TRUE(contains(faultOf("window=0"), "above 0"));
  EXPECT_TRUE(contains(faultOf("window=-1"), "above 0"));
  EXPECT_TRUE(contains(faultOf("max_time_offset=1.01"), "at most 1"));
  EXPECT_TRUE(contains(faultOf("max_iterations=0"), "of at least 1"));
  EXPECT_TRUE(contains(faultOf("max_iterations=99999999999"), "whole number"));
  EXPECT_TRUE(contains(faultOf("ransac_success_probability=1"), "below 1"));
  EXPECT_TRUE(contains(faultOf("ego_velocity_added_sigma=[0.1, -0.1, 0.1]"), "each of at least 0"));
  EXPECT_NO_THROW(fromAssignments({"window=60", "max_time_offset=1.0", "ransac_outlier_probability=0"}));
}

TEST(Parameters, TheEstimatorTakesEveryNumberThatTheRangesAllow) {
  for (const ParameterDescription& about : parameterDescriptions()) {
    std::vector<std::string> values = {"0", "0.5", "1", "2"};
    for (const double end : {about.min, about.max})
      if (std::isfinite(end)) values.push_back(ParameterValue{end}.yaml());
    for (const std::string& value : values) {
      const std::string assignment = about.key + "=" + value;
      std::optional<Config> config;
      try {
        config = fromAssignments({assignment});
      } catch (const ConfigError&) {
        continue;  // refused with its key, as it should be
      }
      EXPECT_NO_THROW(RadarInertialOdometry(config->odometry)) << assignment;
    }
  }
}

TEST(Parameters, OnlyFiniteNumbersAreTaken) {
  for (const char* value : {".nan", ".inf", "-.inf", "nan", "1e999"}) {
    EXPECT_TRUE(contains(faultOf(std::string("radar_stamp_shift=") + value), "finite")) << value;
    EXPECT_TRUE(contains(faultOf("extrinsics_translation=[0, 0, " + std::string(value) + "]"), "finite"))
        << value;
  }
}

TEST(Parameters, UnknownChoicesListTheChoices) {
  EXPECT_TRUE(contains(faultOf("stamp_source=heaader"), "one of header, trigger, arrival, got \"heaader\""));
  EXPECT_TRUE(contains(faultOf("time_offset_model=spline"), "one of constant_acceleration, imu"));
  EXPECT_TRUE(contains(faultOf("radar_format=lidar"), "one of irs, ti_mmwave"));
}

TEST(Parameters, RotationsMustBeUnitAndAreNormalised) {
  EXPECT_TRUE(contains(faultOf("extrinsics_rotation_xyzw=[0, 0, 0, 0]"), "a norm between 0.999 and 1.001"));
  EXPECT_TRUE(
      contains(faultOf("extrinsics_rotation_xyzw=[0, 0, 0, 1.01]"), "a norm between 0.999 and 1.001"));
  const Config config = fromAssignments({"extrinsics_rotation_xyzw=[0.69946, 0.71461, 0.00723, 0.00524]"});
  EXPECT_NEAR(config.odometry.radar.T_IR.q_IR.norm(), 1.0, 1e-15);
  EXPECT_NEAR(config.odometry.radar.T_IR.q_IR.x(), 0.69946, 1e-4);
  EXPECT_NEAR(config.odometry.radar.T_IR.q_IR.w(), 0.00524, 1e-6);
}

TEST(Parameters, UnknownKeysAreErrorsWithTheNearestKey) {
  EXPECT_TRUE(contains(faultOf("widnow=1.0"), "unknown parameter \"widnow\"; did you mean \"window\"?"));
  EXPECT_TRUE(contains(faultOf("estimate_timeoffset=true"), "did you mean \"estimate_time_offset\"?"));
  EXPECT_EQ(faultOf("velodyne_ip=1"),
            "--set: unknown parameter \"velodyne_ip\" (config/estimator.yaml lists all)");
}

TEST(Parameters, ATabThatIndentsIsNamed) {
  try {
    readParameters("radars: [left]\nleft:\n\tradar_topic: left\n", "my.yaml");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_TRUE(contains(error.what(), "a tab cannot indent: use spaces")) << error.what();
  }
}

TEST(Parameters, ContradictionsAreRefused) {
  EXPECT_TRUE(contains(faultsOf({"radar_min_range=10", "radar_max_range=5"}).at(0), "radar_min_range"));
  EXPECT_TRUE(contains(faultsOf({"time_offset_initial=-0.3"}).at(0), "max_time_offset"));
  EXPECT_TRUE(contains(faultsOf({"stamp_source=trigger", "trigger_topic=\"\""}).at(0), "trigger_topic"));
  EXPECT_NO_THROW(fromAssignments({"trigger_topic=\"\""}));
  EXPECT_TRUE(contains(faultsOf({"radar_topic=/a", "imu_topic=/a"}).at(0),
                       "radar_topic: expected another topic than imu_topic, got \"/a\" for both"));
  EXPECT_TRUE(contains(faultsOf({"radar_topic=/a", "stamp_source=trigger", "trigger_topic=/a"}).at(0),
                       "trigger_topic: expected another topic than radar_topic"));
  EXPECT_NO_THROW(fromAssignments({"radar_topic=/a", "trigger_topic=/a"})) << "no trigger is read";
}

/// The weights of the graph, one divided by a sigma, would overflow or leave no digits to the others.
TEST(Parameters, SigmasThatNoSystemOfDoublesHoldsAreRefused) {
  for (const char* key : {"prior_sigma_yaw",
                          "prior_sigma_position",
                          "prior_sigma_velocity",
                          "prior_sigma_gyro_bias",
                          "prior_sigma_accel_bias",
                          "init_motion_sigma_gyro_bias",
                          "init_motion_sigma_accel_bias",
                          "rest_velocity_sigma",
                          "zero_velocity_sigma",
                          "time_offset_sigma",
                          "time_offset_noise",
                          "radar_range_sigma",
                          "vehicle_frame_rotation_sigma",
                          "vehicle_frame_rotation_noise",
                          "vehicle_sideways_sigma",
                          "vehicle_vertical_sigma",
                          "barometer_drift",
                          "extrinsics_rotation_sigma",
                          "extrinsics_rotation_noise",
                          "extrinsics_translation_noise"}) {
    for (const char* value : {"5e-324", "1e-10", "1e4", "1e154"}) {
      EXPECT_TRUE(contains(faultOf(std::string(key) + "=" + value), "of at least 1.0e-09 and at most "))
          << key << " " << value;
    }
  }
  for (const char* key : {"radar_doppler_sigma", "innovation_model_error"})
    EXPECT_TRUE(contains(faultOf(std::string(key) + "=1e4"), "of at least 0 and at most 1000")) << key;
  EXPECT_TRUE(contains(faultOf("ego_velocity_added_sigma=[0, 0, 1e154]"), "at most 1000"));
}

TEST(Parameters, ZeroCountsWhereItHasAMeaningOfItsOwn) {
  for (const char* assignment :
       {"extrinsics_translation_sigma=1e-12", "vehicle_start_slope_sigma=1e-12", "radar_doppler_span=1e-12"})
    EXPECT_TRUE(contains(faultOf(assignment), "of 0, or of at least ")) << assignment;
  EXPECT_NO_THROW(fromAssignments(
      {"extrinsics_translation_sigma=0", "vehicle_start_slope_sigma=0", "radar_doppler_span=0.0"}));
}

TEST(Parameters, WholeNumbersSayWhereTheyEnd) {
  EXPECT_TRUE(contains(faultOf("max_queued_scans=3000000000"), "of at least 1 and at most 2147483647"));
  EXPECT_NO_THROW(fromAssignments({"ransac_seed=2147483647"}));
}

/// The estimate would explode.
TEST(Parameters, NoisesThatNoSensorHasAreRefused) {
  for (const char* key :
       {"imu_accel_noise_density", "imu_gyro_noise_density", "imu_accel_random_walk", "imu_gyro_random_walk",
        "imu_unseen_accel_density", "imu_unseen_gyro_density", "barometer_noise_density"}) {
    const std::string fault = faultsOf({std::string(key) + "=1e9"}).at(0);
    EXPECT_TRUE(contains(fault, std::string(key) + ": expected a finite number above 0 and at most "))
        << fault;
  }
  EXPECT_NO_THROW(fromAssignments({"imu_accel_noise_density=2.0", "imu_gyro_noise_density=0.1"}));
}

TEST(Parameters, AllFaultsAreReportedAtOnce) {
  const std::vector<std::string> faults =
      faultsOf({"window=fast", "widnow=1", "stamp_source=never", "max_iterations=0", "imu_topic=/imu"});
  ASSERT_EQ(faults.size(), 4u);
  try {
    fromAssignments({"window=fast", "widnow=1", "stamp_source=never", "max_iterations=0"});
    FAIL();
  } catch (const ConfigError& error) {
    const std::string message = error.what();
    EXPECT_TRUE(contains(message, "4 faults")) << message;
    for (const std::string& fault : faults) EXPECT_TRUE(contains(message, fault)) << fault;
  }
}

TEST(Parameters, AWrongFileIsOneLineWithFileLineAndExpectation) {
  EXPECT_EQ(messageOfFile("imu_topic: /imu\n\nwindow: fast\n"),
            "FILE:3: window: expected a finite number above 0 and at most 60 [s], got \"fast\"");
  EXPECT_TRUE(contains(messageOfFile("imu_topic: /imu\nwindow: [1\n"), "FILE:3: not YAML"));
  EXPECT_TRUE(contains(messageOfFile("window: 1.0\n: :\n  - x: [\n"), "not YAML"));
  EXPECT_TRUE(
      contains(messageOfFile("\n, window: 1.0\n"), "FILE:2: not YAML"));  // yaml-cpp alone would not end
  EXPECT_TRUE(contains(messageOfFile("- 1\n- 2\n"), "FILE:1: expected one `key: value` a line"));
  EXPECT_TRUE(contains(messageOfFile("just text\n"), "FILE:1: expected one `key: value` a line"));
  EXPECT_TRUE(contains(messageOfFile("window: 1.0\ngravity: 9.8\nwindow: 2.0\n"),
                       "FILE:3: window: expected each key once"));
  EXPECT_EQ(messageOfFile("window: 1.0\n---\ngravity: 9.8\n"),
            "FILE:3: expected one YAML document, here begins a second one");
  EXPECT_EQ(messageOfFile("---\nwindow: 1.0\n---\n"), "nothing wrong") << "the second one is empty";
  EXPECT_TRUE(contains(messageOfFile("radar:\n  topic: /x\n"), "FILE:1: unknown parameter \"radar\""));
  for (const char* text : {"window: fast\n", "a: [\n", "- 1\n"}) {
    EXPECT_FALSE(contains(messageOfFile(text), "\n")) << text;
  }
  EXPECT_EQ(messageOfFile(""), "nothing wrong");
  EXPECT_EQ(messageOfFile("# only a comment\n"), "nothing wrong");
}

TEST(Parameters, MissingFilesAndFoldersAreNamed) {
  EXPECT_THROW(readParameterFile("/nonexistent/x.yaml"), std::runtime_error);
  try {
    readParameterFile("/");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_TRUE(contains(error.what(), "folder")) << error.what();
  }
  EXPECT_THROW(parseAssignment("window"), std::invalid_argument);
  EXPECT_THROW(parseAssignment("=1"), std::invalid_argument);
  EXPECT_THROW(parseAssignment("window=[1"), std::invalid_argument);
}

TEST(Parameters, ConfigurationsAreFoundByNameAndByPath) {
  EXPECT_TRUE(std::filesystem::equivalent(findConfigFile("irs"), kConfigFolder + "/irs.yaml"));
  EXPECT_TRUE(std::filesystem::equivalent(findConfigFile("irs.yaml"), kConfigFolder + "/irs.yaml"));
  EXPECT_EQ(findConfigFile(kConfigFolder + "/irs.yaml"), kConfigFolder + "/irs.yaml");
  try {
    findConfigFile("isr");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_TRUE(contains(error.what(), "estimator, irs, sparse, ti_mmwave, two_radars")) << error.what();
  }
  EXPECT_THROW(findConfigFile("./nonexistent.yaml"), std::runtime_error);
}

TEST(Parameters, ScalarsMeanWhatTheyMeanOnTheParameterServer) {
  EXPECT_TRUE(std::holds_alternative<bool>(parsePlainScalar("yes").data));
  EXPECT_TRUE(std::holds_alternative<std::int64_t>(parsePlainScalar("-12").data));
  EXPECT_TRUE(std::holds_alternative<double>(parsePlainScalar("1.5e-3").data));
  EXPECT_TRUE(std::holds_alternative<double>(parsePlainScalar(".5").data));
  EXPECT_TRUE(std::holds_alternative<std::string>(parsePlainScalar("/topic").data));
  EXPECT_TRUE(std::holds_alternative<std::string>(parsePlainScalar("1.2.3").data));
  EXPECT_TRUE(std::holds_alternative<std::monostate>(parsePlainScalar("~").data));
  // The server's reader gives 1e-3 as text; a number all the same.
  const Config config = makeConfig({{"window", ParameterValue{std::string("1e-1")}, "server"}});
  EXPECT_EQ(config.odometry.smoother.window, 0.1);
}

TEST(Parameters, CommittedFileIsWhatTheProgramPrints) {
  EXPECT_EQ(contents(kConfigFolder + "/estimator.yaml"), toYaml(Config{}))
      << "run `rio_t_bag --print-config > config/estimator.yaml`";
}

TEST(Parameters, CommittedPageIsWhatTheProgramPrints) {
  EXPECT_EQ(contents(std::string(RIO_T_SOURCE_DIR) + "/docs/parameters.md"), parametersMarkdown())
      << "run `rio_t_bag --print-parameters > docs/parameters.md`";
}

TEST(Parameters, TextsAreFullSentences) {
  std::size_t first = 0;
  for (const ParameterDescription& about : parameterDescriptions()) {
    first += about.first ? 1 : 0;
    EXPECT_GE(about.description.size(), 40u) << about.key;
    EXPECT_EQ(about.description.back(), '.') << about.key;
    EXPECT_EQ(about.description.find('\n'), std::string::npos) << about.key;
  }
  EXPECT_GE(first, 12u) << "a new user reads these";
  EXPECT_LE(first, 20u) << "a new user reads all of these";
}

TEST(Parameters, AFolderOfThatNameDoesNotHideAConfiguration) {
  namespace fs = std::filesystem;
  const fs::path before = fs::current_path();
  const fs::path folder = fs::temp_directory_path() / ("rio_t_" + std::to_string(getpid()));
  fs::create_directories(folder / "irs");
  fs::current_path(folder);
  EXPECT_TRUE(fs::equivalent(findConfigFile("irs"), kConfigFolder + "/irs.yaml"));
  fs::current_path(before);
  fs::remove_all(folder);
}

TEST(Parameters, PrintedConfigurationReadsBack) {
  const Config config =
      fromAssignments({"window=0.3333333333333333", "stamp_source=arrival", R"(ground_truth="a \"b\".txt")",
                       "imu_gyro_random_walk=1.2345678901234567e-7", "radar_doppler_sign=-1",
                       "radar_axes=flu", "extrinsics_rotation_xyzw=[0.5, -0.5, 0.5, -0.5]",
                       "extrinsics_translation=[0.1, 0.2, 0.30000000000000004]"});
  const TemporaryFile file(toYaml(config));
  const Config back = makeConfig(readParameterFile(file.path()));
  EXPECT_EQ(toYaml(back), toYaml(config));
  EXPECT_EQ(back.odometry.smoother.window, 0.3333333333333333);
  EXPECT_EQ(back.odometry.imu_noise.gyro_random_walk, 1.2345678901234567e-7);
  EXPECT_EQ(back.odometry.radar.T_IR.l_I.z(), 0.30000000000000004);
  EXPECT_EQ(back.ground_truth, "a \"b\".txt");
}

TEST(Parameters, SensorConfigurationsLoad) {
  const Config irs = makeConfig(readParameterFile(kConfigFolder + "/irs.yaml"));
  EXPECT_EQ(pointCloudFormat(irs).doppler, "v_doppler_mps");
  EXPECT_EQ(irs.stamp_source, StampSource::kHeader);
  const Config ti = makeConfig(readParameterFile(kConfigFolder + "/ti_mmwave.yaml"));
  EXPECT_EQ(pointCloudFormat(ti).doppler, "velocity");
  EXPECT_EQ(pointCloudFormat(ti).axes, PointAxes::kForwardLeftUp);
  EXPECT_EQ(ti.stamp_source, StampSource::kTrigger);
  EXPECT_EQ(ti.odometry.radar.T_IR.l_I, Eigen::Vector3d(0.03, 0.03, -0.06));
  // The mounting is that of the simulated kart, which its first lines promise.
  const Config sparse = makeConfig(readParameterFile(kConfigFolder + "/sparse.yaml"));
  const Extrinsics kart = simulation::presetOf("kart").options.T_IR;
  EXPECT_EQ(pointCloudFormat(sparse).doppler, "v_doppler_mps");
  EXPECT_EQ(sparse.odometry.radar.T_IR.l_I, kart.l_I);
  EXPECT_LT(sparse.odometry.radar.T_IR.q_IR.angularDistance(kart.q_IR), 1e-6);
}

TEST(Parameters, TheTwoRadarsOfTheExampleAreMirrorImages) {
  const std::vector<Config> radars =
      configsOfRadars(makeConfig(readParameterFile(kConfigFolder + "/two_radars.yaml")));
  ASSERT_EQ(radars.size(), 2u);
  const Extrinsics left = radars[0].odometry.radar.T_IR, right = radars[1].odometry.radar.T_IR;
  const Extrinsics kart = simulation::presetOf("kart").options.T_IR;
  EXPECT_EQ(left.l_I, kart.l_I);
  EXPECT_LT(left.q_IR.angularDistance(kart.q_IR), 1e-6);
  const Eigen::Vector3d mirror(1.0, -1.0, 1.0);
  EXPECT_EQ(right.l_I, left.l_I.cwiseProduct(mirror));
  const auto looks = [](const Extrinsics& T_IR) {
    return Eigen::Vector3d(T_IR.q_IR * Eigen::Vector3d::UnitY());
  };
  EXPECT_LT((looks(right) - looks(left).cwiseProduct(mirror)).norm(), 1e-6);
  // Its right stays level, as that of the left radar.
  EXPECT_NEAR((right.q_IR * Eigen::Vector3d::UnitX()).z(), 0.0, 1e-6);
  EXPECT_EQ(radars[0].radar_topic, "sensor_platform/radar_left/scan");
  EXPECT_EQ(radars[1].radar_topic, "sensor_platform/radar_right/scan");
  EXPECT_EQ(radars[1].odometry.smoother.estimate_extrinsics, EstimateExtrinsics::kRotation);
}

TEST(Parameters, OverridesChangeThePresetInAnyOrder) {
  const Config config =
      fromAssignments({"radar_field_doppler=speed", "radar_doppler_sign=-1", "radar_axes=rfu",
                       "radar_power_unit=not_snr", "radar_cloud_size=from_data", "radar_format=ti_mmwave"});
  const PointCloudFormat preset = pointCloudPreset("ti_mmwave");
  const PointCloudFormat format = pointCloudFormat(config);
  EXPECT_EQ(format.doppler, "speed");
  EXPECT_EQ(format.doppler_sign, -1);
  EXPECT_EQ(format.axes, PointAxes::kRightForwardUp);
  EXPECT_EQ(format.power_unit, PowerUnit::kNotSnr);
  EXPECT_TRUE(format.size_from_data);
  EXPECT_EQ(format.x, preset.x);
  for (const std::string& name : pointCloudPresets()) {
    EXPECT_EQ(pointCloudFormat(fromAssignments({"radar_format=" + name})).name, name);
  }
}

// --- Every member of the options has a key -----------------------------------------------------------------

/// Stands for a value of any type in a braced list.
struct Anything {
  template <typename T>
  operator T() const {  // never called: only asked for
    throw std::logic_error("a value of any type");
  }
};

// gcc 10 warns of missing members also where nothing is initialised, and gcc of the constructor by which
// Anything becomes an std::optional.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wconversion"
template <typename T, typename Enable, typename... Values>
struct TakesImpl : std::false_type {};
template <typename T, typename... Values>
struct TakesImpl<T, std::void_t<decltype(T{std::declval<Values>()...})>, Values...> : std::true_type {};
#pragma GCC diagnostic pop

/// Number of members of an aggregate: the longest braced list that it takes.
template <typename T, typename... Values>
constexpr std::size_t memberCount() {
  if constexpr (TakesImpl<T, void, Values..., Anything>::value) {
    return memberCount<T, Values..., Anything>();
  } else {
    return sizeof...(Values);
  }
}

struct TwoMembers {
  double a = 0.0;
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
};
static_assert(memberCount<TwoMembers>() == 2);

std::size_t keysChanging(const std::string& group) {
  std::size_t count = 0;
  for (const ParameterDescription& about : parameterDescriptions()) {
    if (about.group.rfind(group, 0) == 0) ++count;
  }
  return count;
}

TEST(Parameters, EveryMemberOfTheOptionsHasAKey) {
  EXPECT_EQ(keysChanging("Smoother") + keysChanging("Time offset") + keysChanging("Estimate of T_IR"),
            memberCount<SmootherOptions>() + memberCount<CalibrationPrior>() - 1 +
                memberCount<InnovationGateOptions>() + memberCount<OffsetStepDetectorOptions>() + 1)
      << "without T_IR, with max_queued_scans; a member of SmootherOptions or CalibrationPrior lacks a key "
         "in "
         "src/ros/parameters/";
  EXPECT_EQ(keysChanging("Radar: which points"), memberCount<EgoVelocityOptions>());
  EXPECT_EQ(keysChanging("Initialisation"),
            memberCount<StaticInitializerOptions>() + memberCount<MotionInitializerOptions>() + 2)
      << "with init_mode and init_motion_after";
  EXPECT_EQ(keysChanging("Health"), memberCount<HealthOptions>());
  EXPECT_EQ(keysChanging("Rest on the way"), memberCount<RestOptions>());
  EXPECT_EQ(keysChanging("IMU"), memberCount<ImuNoise>() + memberCount<ImuUnits>() + 1) << "with gravity";
  EXPECT_EQ(keysChanging("Gaps of the sensors"), memberCount<ImuInputCheckOptions>() + 2)
      << "with max_imu_gap, max_radar_gap";
  EXPECT_EQ(keysChanging("T_IR"), memberCount<Extrinsics>() + 3)
      << "with extrinsics_source, extrinsics_axes and the mounting in words";
  EXPECT_EQ(memberCount<RadarOptions>(), 2u) << "CalibrationPrior and ego_velocity; a new member needs keys";
  EXPECT_EQ(memberCount<OdometryOptions>(), 22u) << "a new member needs keys in src/ros/parameters/";
  EXPECT_EQ(memberCount<PointCloudFormat>() - 1, memberCount<PointCloudOverrides>()) << "all but its name";
}

}  // namespace
}  // namespace rio_t
