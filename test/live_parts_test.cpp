// Small parts of the live node: observability of the offset, rates of publication, a bounded path, its log.
#include <gtest/gtest.h>
#include <ros/console.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "../src/ros/live/radar_texts.h"
#include "rio_t/evaluation/trajectory.h"
#include "rio_t/odometry/scan_result.h"
#include "rio_t/ros/live/live_log.h"
#include "rio_t/ros/live/publisher.h"
#include "rio_t/ros/live/session.h"
#include "rio_t/ros/live/topic_rate.h"
#include "simulated_run.h"

namespace rio_t {
namespace {

/// Ten scans a second, each of which tells the offset with this sigma [s].
bool observableAt(double sigma, bool used = true, int rest_scans = 0) {
  OffsetObservability observability;
  for (int k = 0; k < 20 + rest_scans; ++k) {
    ScanResult result;
    result.scan.stamp = Time::fromSeconds(0.1 * k);
    result.used = used;
    result.offset_information = k < 20 ? 1.0 / (sigma * sigma) : 0.0;
    observability.add(result);
  }
  return observability.observable();
}

TEST(OffsetObservability, ScansOfASecondTogetherShowTheOffset) {
  // 0.02 s times the root of ten scans is 0.063 s.
  EXPECT_TRUE(observableAt(0.06));
  EXPECT_FALSE(observableAt(0.07));
}

TEST(OffsetObservability, RejectedScansShowNothing) { EXPECT_FALSE(observableAt(0.01, false)); }

TEST(OffsetObservability, IsOfTheLastSecondOnly) {
  EXPECT_TRUE(observableAt(0.03, true, 5));
  EXPECT_FALSE(observableAt(0.03, true, 15));
}

/// Share of the scans after `since` [s] at which the motion shows the offset.
double shareObservable(const SimulatedRun& run, double since) {
  OffsetObservability observability;
  int scans = 0;
  int observable = 0;
  for (const ScanResult& result : run.results) {
    observability.add(result);
    if (run.seconds(result.scan.stamp) < since) continue;
    ++scans;
    observable += observability.observable() ? 1 : 0;
  }
  return static_cast<double>(observable) / scans;
}

TEST(OffsetObservability, MotionShowsTheOffset) {
  SimulatedRun run("medium", 1, 30.0);
  run.run();
  EXPECT_GT(shareObservable(run, 16.0), 0.9);
}

TEST(OffsetObservability, VibrationAtConstantVelocityShowsNothing) {
  SimulatedRun run("constant_speed", 1, 40.0);
  run.setup.imu.rate = 100.0;
  run.setup.imu.accel_vibration = 2.0;
  run.run();
  EXPECT_EQ(shareObservable(run, 20.0), 0.0);
}

TEST(PublishRate, TakesTheFirstOfEachPeriodWhateverTheStart) {
  PublishRate rate(10.0);
  int published = 0;
  for (int k = 0; k < 409; ++k) published += rate.isDue(Time::fromSeconds(1.7e9 + k / 409.0)) ? 1 : 0;
  EXPECT_EQ(published, 10);
  PublishRate late(10.0);
  EXPECT_TRUE(late.isDue(Time::fromSeconds(1.7e9 + 0.05)));
  EXPECT_FALSE(late.isDue(Time::fromSeconds(1.7e9 + 0.09)));
  EXPECT_TRUE(late.isDue(Time::fromSeconds(1.7e9 + 0.11)));
  EXPECT_TRUE(late.isDue(Time::fromSeconds(1.0))) << "the clock jumped back";
}

TEST(PublishRate, OfZeroTakesAll) {
  PublishRate rate(0.0);
  for (int k = 0; k < 3; ++k) EXPECT_TRUE(rate.isDue(Time::fromSeconds(5.0)));
  rate.set(1.0);
  EXPECT_TRUE(rate.isDue(Time::fromSeconds(5.0)));
  EXPECT_FALSE(rate.isDue(Time::fromSeconds(5.5)));
}

TEST(BoundedTrajectory, KeepsEveryPoseUpToItsCapacity) {
  BoundedTrajectory bounded(5);
  EXPECT_TRUE(bounded.poses().empty());
  for (int k = 0; k < 5; ++k) bounded.add({Time::fromSeconds(k), Eigen::Vector3d(k, 0.0, 0.0), {}});
  ASSERT_EQ(bounded.poses().size(), 5U);
  EXPECT_EQ(bounded.poses()[3].p_W.x(), 3.0);
  EXPECT_EQ(bounded.stride(), 1U);
}

TEST(BoundedTrajectory, ThinsOutEvenlyAndReachesFromTheFirstPoseToTheLast) {
  for (const std::size_t capacity : {2U, 3U, 8U, 9U}) {
    BoundedTrajectory bounded(capacity);
    for (int k = 0; k < 200; ++k) {
      bounded.add({Time::fromSeconds(k), Eigen::Vector3d::Zero(), {}});
      const Trajectory poses = bounded.poses();
      EXPECT_LE(poses.size(), capacity + 1);
      EXPECT_EQ(poses.front().time, Time::fromSeconds(0.0));
      EXPECT_EQ(poses.back().time, Time::fromSeconds(k));
      for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
        EXPECT_EQ(poses[i].time, Time::fromSeconds(static_cast<double>(i * bounded.stride())));
      }
    }
    EXPECT_GT(bounded.poses().size(), capacity / 2);
  }
}

TEST(BoundedTrajectory, RefusesACapacityThatCannotHoldBothEnds) {
  EXPECT_THROW(BoundedTrajectory(1), std::invalid_argument);
}

/// The lines that are logged. Lives for ever: the rosconsole of Debian 11 crashes if it is to let an appender
/// go.
class LoggedLines : public ros::console::LogAppender {
 public:
  static LoggedLines& get() {
    static auto* const lines = new LoggedLines;
    return *lines;
  }
  LoggedLines(const LoggedLines&) = delete;
  LoggedLines& operator=(const LoggedLines&) = delete;

  void log(ros::console::Level /*level*/, const char* text, const char* /*file*/, const char* /*function*/,
           int /*line*/) override {
    lines_.emplace_back(text);
  }
  /// Since the last call.
  std::vector<std::string> take() { return std::exchange(lines_, {}); }

 private:
  LoggedLines() {
    ros::console::initialize();  // else the first line would reset the appenders
    ros::console::register_appender(this);
  }

  std::vector<std::string> lines_;
};

TEST(LiveLog, ADivergenceIsNoFaultOfTheInput) {
  const Config config;
  OdometryOptions never_sure = config.odometry;
  never_sure.health.max_velocity_sigma = 1e-6;
  const auto session = std::make_shared<LiveSession>(config, never_sure);
  const auto addImu = [&](double seconds, double rate) {
    session->addImu({Time::fromSeconds(seconds), {rate, 0.0, 0.0}, {0.0, 0.0, 9.81}});
  };
  for (int k = 0; k < 1600; ++k) addImu(0.0025 * k, 0.0);
  addImu(4.0, std::numeric_limits<double>::quiet_NaN());
  bool more = false;
  session->process(&more);
  ASSERT_EQ(session->odometry().faults().count("diverged"), 1U);
  LoggedLines::get().take();
  LiveLog log("node");
  log.faults(session);
  EXPECT_EQ(LoggedLines::get().take(),
            std::vector<std::string>{"node: input fault imu_not_finite, 1 so far"});
}

/// Also if the time of ROS stands still, or goes back because a bag loops.
TEST(TopicRate, OnlySilenceIsAnError) {
  TopicRate rate("/imu");
  const auto levelOfRun = [&rate] {
    diagnostic_updater::DiagnosticStatusWrapper status;
    rate.run(status);
    return static_cast<int>(status.level);
  };
  EXPECT_EQ(rate.getName(), "/imu topic status");
  EXPECT_FALSE(rate.hasTicked());
  EXPECT_EQ(levelOfRun(), diagnostic_msgs::DiagnosticStatus::ERROR);
  rate.tick();
  EXPECT_TRUE(rate.hasTicked());
  for (int k = 0; k < 5; ++k) EXPECT_EQ(levelOfRun(), diagnostic_msgs::DiagnosticStatus::OK) << k;
  EXPECT_EQ(levelOfRun(), diagnostic_msgs::DiagnosticStatus::ERROR);
}

TEST(LiveTexts, AScanWithoutAStampNamesTheKeyToLookAt) {
  Config radar;
  radar.trigger_topic = "/trigger";
  radar.imu_topic = "/imu";
  radar.radar_stamp_shift = -0.5;
  radar.stamp_source = StampSource::kTrigger;
  EXPECT_EQ(whyNoStamp(radar, "trigger_missing"),
            "trigger_missing (stamp_source: trigger, trigger_topic: /trigger)");
  radar.stamp_source = StampSource::kArrival;
  EXPECT_EQ(whyNoStamp(radar, "imu_missing"), "imu_missing (stamp_source: arrival, imu_topic: /imu)");
  radar.stamp_source = StampSource::kHeader;
  EXPECT_EQ(whyNoStamp(radar, "stamp_out_of_range"),
            "stamp_out_of_range (stamp_source: header, radar_stamp_shift: -0.5)");
}

}  // namespace
}  // namespace rio_t
