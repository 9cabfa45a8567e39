// The diagnostics of the live node tell how its only radar, its aids and its solver do.
#include <diagnostic_msgs/DiagnosticStatus.h>
#include <gtest/gtest.h>

#include <string>

#include "monitor_status.h"
#include "rio_t/graph/solver.h"
#include "rio_t/ros/live/monitor.h"
#include "rio_t/ros/live/session.h"

namespace rio_t {
namespace {

using diagnostic_msgs::DiagnosticStatus;

/// Returns the status that one of the monitor's tasks puts into /diagnostics.
template <typename Describe>
LiveMonitor::Status told(LiveMonitor& monitor, Describe describe) {
  LiveMonitor::Status status;
  (monitor.*describe)(status);
  return status;
}

TEST(LiveMonitor, NamesTheTopicOfTheOnlyRadarThatIsSilent) {
  LiveMonitor monitor{Config()};
  monitor.scan();
  LiveMonitor::Status status;
  for (int second = 0; second < 3; ++second) {
    monitor.imu();
    monitor.imuUsable(Time());
    monitor.describeInput(status, nullptr);
    EXPECT_EQ(status.level, second < 2 ? DiagnosticStatus::OK : DiagnosticStatus::WARN) << status.message;
  }
  EXPECT_EQ(status.message, "the radar is silent, topic " + Config().radar_topic);
}

/// A node whose sensors stamp with their uptime works, but others look for its tf at the ROS time of today.
TEST(LiveMonitor, WarnsOfStampsThatCountFromTheStartOfTheImu) {
  const Time today = Time::fromSeconds(1.8e9), uptime = Time::fromSeconds(1234.0);
  const auto status_of = [](Time stamp, Time now) {
    LiveMonitor monitor{Config()};
    monitor.scan();
    monitor.imu();
    monitor.imuUsable(stamp);
    LiveMonitor::RosView view;
    view.now = now;
    monitor.setRosView(view);
    LiveMonitor::Status status;
    monitor.describeInput(status, nullptr);
    return status;
  };
  const LiveMonitor::Status status = status_of(uptime, today);
  EXPECT_EQ(status.level, DiagnosticStatus::WARN);
  EXPECT_EQ(status.message.find("topic " + Config().imu_topic + " has stamps of the year 1970 (1234 s"), 0U)
      << status.message;
  EXPECT_EQ(status_of(today, today).level, DiagnosticStatus::OK);
  EXPECT_EQ(status_of(uptime, uptime).level, DiagnosticStatus::OK) << "a simulation begins at 0";
}

TEST(LiveMonitor, IsNoBatchWhateverTheFileSays) {
  Config config;
  config.mode = RunMode::kBatch;
  LiveMonitor monitor(config);
  const LiveSession session(config, config.odometry);
  LiveSession::Result result;
  result.result.used = result.result.updated = true;
  result.result.solver_termination = SolverTermination::kIterationLimit;
  for (int k = 0; k < 30; ++k) monitor.result(result);
  LiveMonitor::Status status;
  monitor.describeOdometry(status, &session);
  std::string causes;
  for (const auto& each : status.values)
    if (each.key.find("likely_cause") == 0) causes += each.value + "\n";
  EXPECT_NE(causes.find("30 of 30 windows stop before they converge."), std::string::npos) << causes;
  EXPECT_EQ(causes.find("batch"), std::string::npos) << causes;
}

TEST(LiveMonitor, NamesTheTypeOfABarometerThatIsNone) {
  Config config;
  config.barometer_topic = "/baro";
  LiveMonitor monitor(config);
  monitor.imu();
  monitor.scan();
  EXPECT_TRUE(monitor.lacksInput()) << "the type of the topic is wanted";
  LiveMonitor::RosView view;
  view.topic_types["/baro"] = "sensor_msgs/Temperature";
  monitor.setRosView(view);
  LiveMonitor::Status status;
  monitor.describeBarometer(status);
  EXPECT_EQ(status.message,
            "no pressure yet on /baro, which is published as sensor_msgs/Temperature, expected "
            "sensor_msgs/FluidPressure");
  monitor.pressure();
  EXPECT_FALSE(monitor.lacksInput());
}

TEST(LiveMonitor, GivesABarometerTwoSecondsForAPressure) {
  Config config;
  config.barometer_topic = "/baro";
  LiveMonitor monitor(config);
  const auto barometer = [&] { return told(monitor, &LiveMonitor::describeBarometer).message; };
  monitor.pressure();
  EXPECT_EQ(barometer(), "pressures are coming");
  EXPECT_EQ(barometer(), "pressures are coming");
  EXPECT_EQ(barometer(), "the barometer is silent, topic /baro");
  monitor.pressure();
  EXPECT_EQ(barometer(), "pressures are coming");
}

TEST(LiveMonitor, TellsWhetherTheBarometerIsOfUse) {
  Config config;
  config.barometer_topic = "/baro";
  LiveMonitor monitor(config);
  const auto barometer = [&] { return told(monitor, &LiveMonitor::describeBarometer); };
  const auto pressure = [&](const char* rejected_because) {
    monitor.pressure();
    LiveSession::Result result;
    BarometerAnswer& mean = result.result.barometer.emplace_back();
    mean.height = 2.5;
    mean.rejected_because = rejected_because;
    monitor.result(result);
  };
  monitor.pressure();
  monitor.pressureDropped("its unit");
  EXPECT_EQ(barometer().level, DiagnosticStatus::WARN);
  EXPECT_EQ(barometer().message, "no pressure can be used: its unit");
  pressure("");
  EXPECT_EQ(barometer().level, DiagnosticStatus::OK);
  EXPECT_EQ(barometer().message, "in use");
  pressure("gate");
  const LiveMonitor::Status rejected = barometer();
  EXPECT_EQ(rejected.level, DiagnosticStatus::WARN);
  EXPECT_EQ(rejected.message, "no pressure is used now, rejected as gate");
  EXPECT_EQ(value(rejected, "pressures"), "3");
  EXPECT_EQ(value(rejected, "pressures_not_usable"), "1");
  EXPECT_EQ(value(rejected, "means_used"), "1");
  EXPECT_EQ(value(rejected, "means_rejected_gate"), "1");
  EXPECT_EQ(value(rejected, "height_m"), "2.5");
}

TEST(LiveMonitor, TellsWhetherTheMotionIsThatOfAVehicle) {
  Config config;
  config.odometry.platform = Platform::kGroundVehicle;
  LiveMonitor monitor(config);
  const auto vehicle = [&] { return told(monitor, &LiveMonitor::describeGroundVehicle); };
  EXPECT_EQ(vehicle().message, "no motion judged yet");
  LiveSession::Result result;
  GroundVehicleAnswer& answer = result.result.ground_vehicle.emplace();
  answer.used = true;
  answer.v_V = {3.0, 0.25, -0.5};
  monitor.result(result);
  EXPECT_EQ(vehicle().level, DiagnosticStatus::OK);
  EXPECT_EQ(vehicle().message, "the motion agrees");
  EXPECT_EQ(value(vehicle(), "contradiction"), "no contradiction") << "too early";
  answer.used = false;
  answer.contradiction = 0.75;
  answer.is_contradicted = true;
  monitor.result(result);
  const LiveMonitor::Status status = vehicle();
  EXPECT_EQ(status.level, DiagnosticStatus::WARN);
  EXPECT_EQ(status.message, kGroundVehicleContradicted);
  EXPECT_EQ(value(status, "terms_used"), "1");
  EXPECT_EQ(value(status, "terms_left_out"), "1");
  EXPECT_EQ(value(status, "velocity_sideways_m_s"), "0.25");
  EXPECT_EQ(value(status, "velocity_upwards_m_s"), "-0.5");
  EXPECT_EQ(value(status, "contradiction"), "0.75");
  EXPECT_EQ(value(status, "vehicle_frame_rotation_xyzw"), "[0.000000, 0.000000, 0.000000, 1.000000]");
}

TEST(LiveMonitor, TellsWhetherTheMapOfLandmarksHelps) {
  Config config;
  config.odometry.landmarks.enabled = true;
  LiveMonitor monitor(config);
  const auto landmarks = [&] { return told(monitor, &LiveMonitor::describeLandmarks); };
  EXPECT_EQ(landmarks().message, "too few landmarks were seen again, the map waits");
  LiveSession::Result result;
  LandmarkAnswer& answer = result.result.landmarks.emplace();
  answer.map.resize(3);
  monitor.result(result);
  answer.is_trusted = true;
  monitor.result(result);
  const LiveMonitor::Status status = landmarks();
  EXPECT_EQ(status.level, DiagnosticStatus::OK);
  EXPECT_EQ(status.message, "the map helps the estimate");
  EXPECT_EQ(value(status, "landmarks"), "3");
  EXPECT_EQ(value(status, "scans"), "2");
  EXPECT_EQ(value(status, "scans_trusted"), "1");
}

TEST(LiveMonitor, TheOffsetOfTheOnlyRadarIsKeptOnceItFallsSilent) {
  LiveMonitor monitor{Config()};
  LiveSession::Result result;
  result.result.used = result.result.updated = true;
  result.result.state.time = Time::fromSeconds(9.0);
  result.offset_observable = true;
  monitor.result(result);
  const auto offsetAt = [&](double now) {
    NavigationState newest;
    newest.time = Time::fromSeconds(now);
    monitor.odometry(newest, 0.0);
    LiveMonitor::Status status;
    monitor.describeTimeOffset(status);
    return status.message;
  };
  EXPECT_EQ(offsetAt(10.7), "observed by the motion now")
      << "a radar at 1 Hz, whose scan waits for a trigger";
  EXPECT_EQ(offsetAt(11.1), "kept: no scan of the radar is used now");
}

TEST(LiveMonitor, SaysThatTheOffsetIsHeld) {
  Config config;
  config.odometry.smoother.estimate_time_offset = false;
  LiveMonitor monitor(config);
  LiveSession::Result result;
  result.result.used = result.result.updated = true;
  result.result.time_offset = config.odometry.smoother.max_time_offset;
  monitor.result(result);
  LiveMonitor::Status status;
  monitor.describeTimeOffset(status);
  EXPECT_EQ(status.level, DiagnosticStatus::OK);
  EXPECT_EQ(status.message, "held: estimate_time_offset is false");
}

/// What `diagnostics` says of the solver.
class SolverDiagnostics : public testing::Test {
 protected:
  void windows(SolverTermination termination, int count) {
    LiveSession::Result result;
    result.result.updated = true;
    result.result.solver_termination = termination;
    for (int k = 0; k < count; ++k) monitor.result(result);
  }
  LiveMonitor::Status status() const {
    LiveMonitor::Status status;
    monitor.describeSolver(status);
    return status;
  }
  void expectWarning(const std::string& part) const {
    const LiveMonitor::Status now = status();
    EXPECT_EQ(now.level, diagnostic_msgs::DiagnosticStatus::WARN) << now.message;
    EXPECT_NE(now.message.find(part), std::string::npos) << now.message;
  }

  LiveMonitor monitor{Config()};
};

TEST_F(SolverDiagnostics, WarnWhileMostWindowsEndAtTheBound) {
  EXPECT_EQ(status().level, diagnostic_msgs::DiagnosticStatus::OK);
  windows(SolverTermination::kAtBound, 19);
  EXPECT_EQ(status().level, diagnostic_msgs::DiagnosticStatus::OK) << "too few to judge";
  windows(SolverTermination::kAtBound, 1);
  expectWarning("20 of the last 20 windows ended at the bound of the offset: max_time_offset");
  windows(SolverTermination::kConverged, 9);
  expectWarning("11 of the last 20 windows");
  windows(SolverTermination::kConverged, 1);
  EXPECT_EQ(status().level, diagnostic_msgs::DiagnosticStatus::OK);
  EXPECT_EQ(value(status(), "at_bound"), "20");
}

TEST_F(SolverDiagnostics, WarnOfWhatIsMostFrequent) {
  windows(SolverTermination::kIterationLimit, 5);
  windows(SolverTermination::kNoDecrease, 7);
  windows(SolverTermination::kConverged, 8);
  expectWarning("7 of the last 20 windows ended without a step that lowers the cost");
  windows(SolverTermination::kIterationLimit, 12);
  expectWarning("12 of the last 20 windows ended at max_iterations");
  monitor.reset("~reset called");
  EXPECT_EQ(status().level, diagnostic_msgs::DiagnosticStatus::OK);
}

}  // namespace
}  // namespace rio_t
