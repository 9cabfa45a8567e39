// Parameters of several radars: names, sections, what each may have of its own.
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "parameter_faults.h"
#include "rio_t/ros/parameters/parameters.h"

namespace rio_t {
namespace {

const std::vector<std::string> kTwoRadars = {"radars=[left, right]", "left/radar_topic=/left",
                                             "right/radar_topic=/right"};

std::vector<std::string> withTwoRadars(const std::vector<std::string>& more) {
  std::vector<std::string> all = kTwoRadars;
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

std::string faultWithTwoRadars(const std::vector<std::string>& more) {
  const std::vector<std::string> faults = faultsOf(withTwoRadars(more));
  return faults.size() == 1 ? faults.front() : "not one fault but " + std::to_string(faults.size());
}

TEST(SeveralRadars, OneRadarIsTheConfigurationItself) {
  const Config config = fromAssignments({"radar_topic=/only"});
  EXPECT_TRUE(config.radars.empty());
  EXPECT_TRUE(config.odometry.radars.empty());
  ASSERT_EQ(configsOfRadars(config).size(), 1u);
  EXPECT_EQ(configsOfRadars(config).front().radar_topic, "/only");
}

TEST(SeveralRadars, ASectionOverridesTheTopLevel) {
  const Config config = fromAssignments(withTwoRadars(
      {"left/radar_format=ti_mmwave", "left/time_offset_initial=0.02", "time_offset_initial=0.01",
       "radar_min_range=0.7", "right/extrinsics_translation=[1, 2, 3]", "right/radar_min_range=0.9",
       "right/time_offset_sigma=0.03", "right/stamp_source=arrival"}));
  const std::vector<Config> radars = configsOfRadars(config);
  ASSERT_EQ(radars.size(), 2u);
  EXPECT_EQ(radars[0].radar_name, "left");
  EXPECT_EQ(radars[0].radar_topic, "/left");
  EXPECT_EQ(pointCloudFormat(radars[0]).name, "ti_mmwave");
  EXPECT_EQ(radars[0].stamp_source, StampSource::kHeader);
  EXPECT_EQ(radars[0].odometry.radar.time_offset_initial, 0.02);
  EXPECT_EQ(radars[1].radar_topic, "/right");
  EXPECT_EQ(pointCloudFormat(radars[1]).name, "irs");
  EXPECT_EQ(radars[1].stamp_source, StampSource::kArrival);
  EXPECT_EQ(radars[1].odometry.radar.time_offset_initial, 0.01);

  const std::vector<RadarOptions>& options = config.odometry.radars;
  ASSERT_EQ(options.size(), 2u);
  EXPECT_EQ(options[0].time_offset_initial, 0.02);
  EXPECT_EQ(options[0].ego_velocity.min_range, 0.7);
  EXPECT_EQ(options[1].time_offset_initial, 0.01);
  EXPECT_EQ(options[1].time_offset_sigma, 0.03);
  EXPECT_EQ(options[1].ego_velocity.min_range, 0.9);
  EXPECT_EQ(options[1].T_IR.l_I, Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(config.odometry.radar.T_IR.l_I, OdometryOptions{}.radar.T_IR.l_I);
}

TEST(SeveralRadars, EachHasAFrameOfItsOwn) {
  const std::vector<Config> radars =
      configsOfRadars(fromAssignments(withTwoRadars({"radar_frame=front", "right/radar_frame=other"})));
  EXPECT_EQ(radars[0].radar_frame, "front_left");
  EXPECT_EQ(radars[1].radar_frame, "other");
}

/// As two_robots.launch sets it beside a file.
TEST(SeveralRadars, TwoRobotsHaveDifferentFrames) {
  const auto frames = [](const std::vector<std::string>& more) {
    std::vector<std::string> result;
    for (const Config& radar : configsOfRadars(fromAssignments(withTwoRadars(more))))
      result.push_back(radar.radar_frame);
    return result;
  };
  const std::vector<std::string> usual = {"rio_t_radar_left", "rio_t_radar_right"};
  const std::vector<std::string> of_robot = {"robot1/radar_left", "robot1/radar_right"};
  EXPECT_EQ(frames({}), usual);
  EXPECT_EQ(frames({"radar_frame=robot1/radar"}), of_robot);
}

TEST(SeveralRadars, SectionsAreNestedKeysOfAFile) {
  const TemporaryFile file(
      "left:\n  radar_topic: /left\n  extrinsics_translation: [1, 0, 0]\nradars: [left, right, rear]\n"
      "right: {radar_topic: /right}\nrear:\n");
  const std::vector<Config> radars = configsOfRadars(makeConfig(readParameterFile(file.path())));
  ASSERT_EQ(radars.size(), 3u);
  EXPECT_EQ(radars[0].radar_topic, "/left");
  EXPECT_EQ(radars[0].odometry.radar.T_IR.l_I, Eigen::Vector3d(1.0, 0.0, 0.0));
  EXPECT_EQ(radars[1].radar_topic, "/right");
  EXPECT_EQ(radars[2].radar_topic, Config{}.radar_topic);
}

TEST(SeveralRadars, LaterEntriesHoldInASectionToo) {
  const Config radar = configsOfRadars(fromAssignments({"left={radar_topic: /first, radar_min_range: 0.8}",
                                                        "radars=[left]", "left/radar_topic=/second"}))
                           .front();
  EXPECT_EQ(radar.radar_topic, "/second");
  EXPECT_EQ(radar.odometry.radar.ego_velocity.min_range, 0.8);
}

TEST(SeveralRadars, NamesAreChecked) {
  for (const char* names :
       {"[Left]", "[left, left]", "[\"\"]", "left", "[a-b]", "[1]", "[[left]]", "[l/r]"}) {
    EXPECT_TRUE(
        contains(faultOf(std::string("radars=") + names),
                 "radars: expected a list of at most 16 different names of lower case letters, digits and _"))
        << names;
  }
  for (const std::string name : {"window", "config", "effective", "diagnostic_period", "diagnostic_updater"})
    EXPECT_EQ(faultOf("radars=[" + name + "]"),
              "radars: expected names that are no parameters, got \"" + name + "\"");
  EXPECT_TRUE(contains(faultOf("radars=[a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q]"), "at most 16"));
  EXPECT_TRUE(fromAssignments({"radars=[]"}).radars.empty());
}

TEST(SeveralRadars, WhatHoldsForAllBelongsToTheTopLevel) {
  EXPECT_EQ(
      faultWithTwoRadars({"left/window=2.0"}),
      "--set: left/window: window holds for all radars; expected it at the top level, not in the section "
      "of a radar");
  EXPECT_TRUE(contains(faultWithTwoRadars({"left/radars=[a]"}), "radars holds for all radars"));
  EXPECT_TRUE(contains(faultWithTwoRadars({"left/estimate_extrinsics=pose"}), "holds for all radars"));
  EXPECT_TRUE(contains(faultWithTwoRadars({"left/imu_topic=/imu"}), "holds for all radars"));
}

TEST(SeveralRadars, UnknownKeysAndSectionsAreNamed) {
  EXPECT_TRUE(contains(faultWithTwoRadars({"left/radar_topc=/x"}),
                       "--set: unknown parameter \"left/radar_topc\"; did you mean \"left/radar_topic\"?"));
  EXPECT_EQ(faultWithTwoRadars({"middle/radar_topic=/x", "middle/radar_format=irs"}),
            "--set: unknown parameter \"middle\" with keys of its own; expected the name of a radar, and "
            "`radars` has left, right");
  EXPECT_TRUE(contains(faultOf("left/radar_topic=/x"), "`radars` has none"));
  EXPECT_TRUE(contains(faultWithTwoRadars({"left=5"}), "left: expected nested keys, as left is the name"));
  EXPECT_TRUE(contains(faultWithTwoRadars({"left/radar_topic={a: 1}"}), "got nested keys"));
  EXPECT_TRUE(contains(faultWithTwoRadars({"left/a/b=1"}), "unknown parameter \"left/a/b\""));
  EXPECT_EQ(messageOfFile("radars: [left]\nleft:\n  radar_format: irs\n  radar_min_range: near\n"),
            "FILE:4: left/radar_min_range: expected a finite number of at least 0 [m], got \"near\"");
  EXPECT_TRUE(contains(messageOfFile("radars: [left]\nleft:\n  radar_topic: /a\n  radar_topic: /b\n"),
                       "FILE:4: radar_topic: expected each key once, it stands in line 3 too"));
  EXPECT_TRUE(contains(messageOfFile("radars: [left]\nleft: &a\n  radar_topic: *a\n"), "got nested keys"));
  EXPECT_THROW(parseAssignment("left={a: 1, a: 2}"), std::invalid_argument);
}

TEST(SeveralRadars, OneCanBeTakenOutAndItsSectionStays) {
  const std::vector<std::string> file = {"radars=[left, right]", "left/radar_topic=/l",
                                         "right/radar_topic=/r"};
  const auto entriesWith = [&](const std::vector<std::string>& more) {
    ParameterEntries entries;
    for (const std::string& text : file) entries.push_back(parseAssignment(text));
    for (const std::string& text : more) entries.push_back(parseAssignment(text));
    return entries;
  };
  const Config left = makeConfig(entriesWith({"radars=[left]"}));
  ASSERT_EQ(configsOfRadars(left).size(), 1U);
  EXPECT_EQ(configsOfRadars(left).front().radar_topic, "/l");
  // The parser checks the section of a radar that is taken out, too.
  EXPECT_THROW(makeConfig(entriesWith({"radars=[left]", "right/radar_tpic=/x"})), ConfigError);
  EXPECT_THROW(makeConfig(entriesWith({"radars=[left]", "middle/radar_topic=/x"})), ConfigError);
}

TEST(SeveralRadars, ContradictionsNameTheRadar) {
  EXPECT_TRUE(contains(faultOf("radars=[left, right]"),
                       "right/radar_topic: expected another than that of left, got \"sensor_platform"));
  EXPECT_TRUE(contains(faultWithTwoRadars({"left/radar_frame=f", "right/radar_frame=f"}),
                       "right/radar_frame: expected another than that of left, got \"f\" for both"));
  EXPECT_TRUE(contains(faultWithTwoRadars({"right/time_offset_initial=0.3"}), "right/time_offset_initial:"));
  EXPECT_TRUE(contains(faultWithTwoRadars({"right/radar_min_range=10", "radar_max_range=5"}),
                       "right/radar_min_range: expected less than radar_max_range (5.0 m), got 10.0"));
  EXPECT_TRUE(contains(faultWithTwoRadars({"left/stamp_source=trigger", "left/trigger_topic="}),
                       "left/trigger_topic: expected a topic"));
  EXPECT_TRUE(contains(faultWithTwoRadars({"time_offset_shared=true", "right/time_offset_initial=0.1"}),
                       "since time_offset_shared is true"));
  EXPECT_NO_THROW(fromAssignments(withTwoRadars({"time_offset_shared=true", "time_offset_initial=0.1"})));
  // Overridden by both, the value of the top level is nobody's.
  const TemporaryFile file(
      "radars: [left, right]\ntime_offset_initial: 0.3\n"
      "left: {radar_topic: /left, time_offset_initial: 0.1}\n"
      "right: {radar_topic: /right, time_offset_initial: 0.1}\n");
  EXPECT_NO_THROW(makeConfig(readParameterFile(file.path())));
}

TEST(SeveralRadars, PrintedConfigurationReadsBack) {
  const Config config = fromAssignments(
      withTwoRadars({"radars=[left, right, rear]", "rear/radar_topic=/rear", R"(left/radar_field_x="a \"b")",
                     "left/extrinsics_rotation_xyzw=[0.5, -0.5, 0.5, -0.5]",
                     "left/time_offset_initial=0.1234567890123456", "right/radar_doppler_step=0.125",
                     "radar_min_range=0.9", "right/radar_min_range=0.3", "radar_frame=robot1/radar",
                     "rear/radar_frame=radar", "estimate_extrinsics=pose", "extrinsics_rotation_sigma=0.2"}));
  const std::string yaml = toYaml(config);
  EXPECT_TRUE(contains(yaml, "\nradars: [left, right, rear]\n")) << yaml;
  EXPECT_TRUE(contains(yaml,
                       "\nright:\n  radar_topic: /right\n  radar_min_range: 0.3\n  "
                       "radar_doppler_step: 0.125\n"))
      << "only what differs: " << yaml;
  const TemporaryFile file(yaml);
  const Config back = makeConfig(readParameterFile(file.path()));
  EXPECT_EQ(toYaml(back), yaml);
  ASSERT_EQ(back.radars.size(), 3u);
  EXPECT_EQ(back.radars[0].odometry.radar.time_offset_initial, 0.1234567890123456);
  EXPECT_EQ(back.radars[0].radar_overrides.x, "a \"b");
  EXPECT_EQ(back.radars[0].radar_frame, "robot1/radar_left");
  EXPECT_EQ(back.radars[2].radar_frame, "radar");
  EXPECT_EQ(back.odometry.smoother.estimate_extrinsics, EstimateExtrinsics::kPose);
  EXPECT_EQ(back.odometry.radars[1].ego_velocity.min_range, 0.3);
}

TEST(SeveralRadars, NamesThatWouldShareAKeyAreRefused) {
  const auto faults =
      faultsOf({"radars=[left, from_left]", "left/radar_topic=/a", "from_left/radar_topic=/b"});
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0], "radars: left and from_left would share keys of summary.yaml; expected another name");
}

TEST(SeveralRadars, AValueThatEachSectionHidesIsRefused) {
  const std::vector<std::string> sections = {"radars=[left, right]", "left/radar_topic=/a",
                                             "right/radar_topic=/b",
                                             "left/extrinsics_rotation_xyzw=[0, 0, 0, 1]"};
  const auto with = [&](const std::string& more) {
    std::vector<std::string> all = sections;
    all.push_back(more);
    return faultsOf(all);
  };
  EXPECT_EQ(
      with("radar_topic=/c"),
      std::vector<std::string>{"--set: radar_topic would do nothing, since each radar has its own; expected "
                               "left/radar_topic, right/radar_topic"});
  EXPECT_EQ(
      faultsOf({"radars=[left, right]", "left/radar_topic=/a", "right/radar_topic=/b",
                "left/extrinsics_rotation_xyzw=[0, 0, 0, 1]", "right/extrinsics_rotation_xyzw=[0, 0, 0, 1]",
                "mounting_yaw_pitch_roll_deg=[0, 0, 180]"})
          .size(),
      1u)
      << "either key turns the radar";
  EXPECT_TRUE(with("mounting_yaw_pitch_roll_deg=[0, 0, 180]").empty()) << "the right radar takes it";
  // As roslaunch radar_topic:=/c sets it beside a file. One file may hold both levels.
  ParameterEntries entries =
      readParameters("radars: [left]\nradar_topic: /c\nleft: {radar_topic: /a}\n", "FILE");
  EXPECT_NO_THROW(makeConfig(entries));
  entries.push_back({"radar_topic", {std::string("/d")}, kParameterServer + "/rio_t/radar_topic"});
  EXPECT_THROW(makeConfig(entries), ConfigError);
  for (ParameterEntry& entry : entries) entry.origin = kParameterServer + "/rio_t/" + entry.key;
  std::get<ParameterValue::Map>(entries[2].value.data).front().origin = kParameterServer + "/rio_t/left/x";
  EXPECT_NO_THROW(makeConfig(entries)) << "a file that rosparam loaded";
}

TEST(SeveralRadars, WhatARadarMayHaveOfItsOwn) {
  std::set<std::string> own;
  for (const ParameterDescription& about : parameterDescriptions()) {
    if (about.of_radar) own.insert(about.key);
  }
  for (const char* key :
       {"radar_topic", "trigger_topic", "radar_format", "stamp_source", "radar_stamp_shift", "radar_frame",
        "extrinsics_source", "extrinsics_translation", "extrinsics_rotation_xyzw", "radar_axes",
        "radar_doppler_step", "ego_velocity_added_sigma", "time_offset_initial", "time_offset_sigma"}) {
    EXPECT_EQ(own.count(key), 1u) << key;
  }
  for (const char* key :
       {"imu_topic", "ground_truth_topic", "base_link_frame", "time_offset_shared", "time_offset_noise",
        "max_time_offset", "estimate_extrinsics", "extrinsics_rotation_sigma", "gravity", "window", "mode"}) {
    EXPECT_EQ(own.count(key), 0u) << key;
  }
}

}  // namespace
}  // namespace rio_t
