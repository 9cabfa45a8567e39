// The parameters that dynamic_reconfigure changes: texts and ranges of the registry, values in and out.
#include "rio_t/ros/live/live_parameters.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace rio_t {
namespace {

double& doubleOf(dynamic_reconfigure::Config& message, const std::string& key) {
  const auto found = std::find_if(message.doubles.begin(), message.doubles.end(),
                                  [&](const auto& each) { return each.name == key; });
  if (found == message.doubles.end()) throw std::out_of_range(key);
  return found->value;
}

TEST(LiveParameters, HaveTheTextsAndRangesOfTheRegistry) {
  const auto description = LiveParameters::__getDescriptionMessage__();
  ASSERT_EQ(description.groups.size(), 1U);
  const auto& parameters = description.groups[0].parameters;
  ASSERT_EQ(parameters.size(), liveKeys().size());
  for (const ParameterDescription& about : parameterDescriptions()) {
    const auto found = std::find_if(parameters.begin(), parameters.end(),
                                    [&](const auto& each) { return each.name == about.key; });
    if (found == parameters.end()) continue;
    EXPECT_NE(found->description.find(about.description), std::string::npos) << about.key;
    EXPECT_FALSE(about.of_radar) << about.key << ": one value for all radars";
  }
  auto least = description.min, most = description.max;
  EXPECT_EQ(doubleOf(least, "innovation_gate"), 0.0);
  EXPECT_EQ(doubleOf(most, "innovation_gate"), std::numeric_limits<double>::infinity());
}

TEST(LiveParameters, ComeBackFromTheirMessage) {
  Config config;
  config.odom_rate = 30.0;
  config.correct_stamps = false;
  config.path_max_poses = 7;
  dynamic_reconfigure::Config message;
  LiveParameters(config).__toMessage__(message);
  LiveParameters read;
  ASSERT_TRUE(read.__fromMessage__(message));
  EXPECT_TRUE(read.changesFrom(config).empty());
  const Config same = withParameters(Config(), read.changesFrom(Config()));
  EXPECT_EQ(same.odom_rate, 30.0);
  EXPECT_FALSE(same.correct_stamps);
  EXPECT_EQ(same.path_max_poses, 7U);
}

TEST(LiveParameters, ChangeAllRadars) {
  Config config =
      makeConfig({parseAssignment("radars=[left, right]"), parseAssignment("left/radar_topic=/left"),
                  parseAssignment("right/radar_topic=/right")});
  dynamic_reconfigure::Config message;
  LiveParameters(config).__toMessage__(message);
  doubleOf(message, "innovation_gate") = 5.5;
  LiveParameters wanted(config);
  wanted.__fromMessage__(message);
  const ParameterEntries changes = wanted.changesFrom(config);
  ASSERT_EQ(changes.size(), 1U);
  config = withParameters(config, changes);
  EXPECT_EQ(config.odometry.innovation_gate.sigmas, 5.5);
  for (const Config& radar : config.radars) EXPECT_EQ(radar.odometry.innovation_gate.sigmas, 5.5);
}

TEST(LiveParameters, RefuseWhatTheRegistryRefuses) {
  for (const double wrong : {-1.0, 1e9, std::numeric_limits<double>::quiet_NaN()}) {
    dynamic_reconfigure::Config message;
    LiveParameters(Config()).__toMessage__(message);
    doubleOf(message, "imu_gyro_noise_density") = wrong;
    LiveParameters wanted;
    wanted.__fromMessage__(message);
    try {
      withParameters(Config(), wanted.changesFrom(Config()));
      FAIL() << wrong;
    } catch (const ConfigError& error) {
      EXPECT_NE(std::string(error.what()).find("dynamic_reconfigure: imu_gyro_noise_density: expected"),
                std::string::npos)
          << error.what();
    }
  }
}

/// What is said about a message with one value more than those of today.
template <typename Parameter, typename Value>
std::string refusal(std::vector<Parameter> dynamic_reconfigure::Config::*kind, const std::string& name,
                    const Value& value) {
  dynamic_reconfigure::Config message;
  Parameter parameter;
  parameter.name = name;
  parameter.value = value;
  (message.*kind).push_back(parameter);
  LiveParameters values;
  values.__fromMessage__(message);
  try {
    withParameters(Config(), values.changesFrom(Config()));
    return "nothing";
  } catch (const ConfigError& error) {
    return error.what();
  }
}

TEST(LiveParameters, RefuseKeysThatMayNotChange) {
  using dynamic_reconfigure::Config;
  for (const std::string name : {"window", "odom_rat"}) {
    const std::string told = refusal(&Config::doubles, name, 3.0);
    EXPECT_NE(told.find("\"" + name + "\" does not change while the node runs; what does: "),
              std::string::npos)
        << told;
    EXPECT_NE(told.find(", odom_rate, "), std::string::npos) << told;
  }
}

TEST(LiveParameters, RefuseTextForANumber) {
  const std::string told = refusal(&dynamic_reconfigure::Config::strs, "odom_rate", "fast");
  EXPECT_NE(told.find("odom_rate: expected a finite number"), std::string::npos) << told;
}

}  // namespace
}  // namespace rio_t
