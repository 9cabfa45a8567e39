// The diagnostics of the live node tell how its two radars do.
#include <diagnostic_msgs/DiagnosticStatus.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <map>
#include <string>
#include <utility>

#include "monitor_status.h"
#include "rio_t/core/so3.h"
#include "rio_t/factors/state_block.h"
#include "rio_t/graph/solver.h"
#include "rio_t/ros/live/monitor.h"
#include "rio_t/ros/live/session.h"
#include "two_radars_config.h"

namespace rio_t {
namespace {

using diagnostic_msgs::DiagnosticStatus;

/// What `diagnostics` says of two radars.
class TwoRadarDiagnostics : public testing::Test {
 protected:
  using Status = LiveMonitor::Status;

  TwoRadarDiagnostics() {
    rest(session, 0, 4);  // initialised
  }

  /// The IMU at rest, between these seconds.
  static void rest(LiveSession& of, int from, int to) {
    for (int k = 400 * from; k < 400 * to; ++k)
      of.addImu({Time::fromSeconds(0.0025 * k), Eigen::Vector3d::Zero(), {0.0, 0.0, 9.81}});
    bool more = false;
    of.process(&more);
  }
  void imuSample(Time stamp = Time()) {
    monitor.imu();
    monitor.imuUsable(stamp);
  }
  /// A second in which the IMU and these numbers of scans come; so many of those of right are used.
  Status second(int left, int right, int right_used) {
    imuSample();
    for (int k = 0; k < left; ++k) feed(0, true);
    for (int k = 0; k < right; ++k) feed(1, k < right_used);
    Status status;
    monitor.describeInput(status, &session);
    return status;
  }
  void feed(std::size_t radar, bool is_used) {
    monitor.scan(radar);
    if (radar == 1) monitor.trigger(1);
    LiveSession::Result result;
    result.result.scan.radar = radar;
    result.result.scan.stamp = Time::fromSeconds(0.01 * ++fed);
    result.result.used = is_used;
    if (!is_used) result.result.rejected_because = "innovation";
    monitor.result(result);
  }
  /// An update by a scan of a radar.
  void update(std::size_t radar, double stamp, double offset, const Extrinsics& T_IR,
              double turn_sigma = 0.02, double lever_sigma = 0.01) {
    LiveSession::Result result;
    result.result.scan.radar = radar;
    result.result.scan.stamp = result.result.state.time = Time::fromSeconds(stamp);
    result.result.used = result.result.updated = true;
    result.result.time_offset = offset;
    result.result.T_IR = T_IR;
    result.result.configured_T_IR = kMountings[radar];
    result.result.T_IR_covariance.diagonal().head<3>().setConstant(lever_sigma * lever_sigma);
    result.result.T_IR_covariance.diagonal().tail<3>().setConstant(turn_sigma * turn_sigma);
    result.offset_observable = true;
    monitor.result(result);
  }
  void setPublishers(std::map<std::string, std::uint32_t> publishers) {
    LiveMonitor::RosView view;
    view.publishers = std::move(publishers);
    monitor.setRosView(std::move(view));
  }
  Status input() {
    Status status;
    monitor.describeInput(status, &session);
    return status;
  }
  Status odometry(const LiveSession& of) {
    Status status;
    monitor.describeOdometry(status, &of);
    return status;
  }
  Status extrinsics(std::size_t radar) const {
    Status status;
    monitor.describeExtrinsics(status, radar);
    return status;
  }

  const Config config = twoRadars();
  LiveMonitor monitor{config};
  LiveSession session{config, config.odometry};
  int fed = 0;
};

TEST_F(TwoRadarDiagnostics, CountForEachRadar) {
  ASSERT_TRUE(session.odometry().initialized());
  monitor.dropped(0, "cloud_not_usable");
  const Status status = second(20, 10, 9);
  EXPECT_EQ(status.level, DiagnosticStatus::OK) << status.message;
  EXPECT_EQ(value(status, "left/scans"), "20");
  EXPECT_EQ(value(status, "right/scans"), "10");
  EXPECT_EQ(value(status, "right/scans_used"), "9");
  EXPECT_EQ(value(status, "left/dropped_cloud_not_usable"), "1");
  EXPECT_EQ(value(status, "right/dropped_innovation"), "1");
  EXPECT_EQ(value(status, "left/triggers"), "no left/triggers") << "it needs none";
}

TEST_F(TwoRadarDiagnostics, NameTheCauseOfScansThatCannotBeUsed) {
  for (const char* reason : {"cloud_not_usable", "stamp_zero"}) {
    monitor.reset("~reset called");
    monitor.dropped(0, reason, 30);
    EXPECT_EQ(value(odometry(session), "likely_cause_1").find("30 of 30 scans of radar left"), 0U) << reason;
  }
}

TEST_F(TwoRadarDiagnostics, NameTheRadarThatIsSilent) {
  const Status never = second(20, 0, 0);
  EXPECT_EQ(never.level, DiagnosticStatus::WARN) << "the other one works";
  EXPECT_EQ(never.message, "radar right: no scan yet on /right");
  second(20, 20, 20);
  EXPECT_EQ(second(20, 0, 0).level, DiagnosticStatus::OK) << "a radar at 1 Hz may miss a second";
  const Status silent = second(20, 0, 0);
  EXPECT_EQ(silent.level, DiagnosticStatus::WARN);
  EXPECT_EQ(silent.message, "radar right is silent, topic /right");
  EXPECT_EQ(second(20, 20, 20).level, DiagnosticStatus::OK);
}

/// The solver does not get at a scan that the IMU does not cover.
TEST_F(TwoRadarDiagnostics, DoNotBlameTheSolverAloneForScansThatWaitedTooLong) {
  second(20, 20, 20);
  monitor.dropped(0, "queue_full");
  const Status status = second(20, 20, 20);
  EXPECT_EQ(status.level, DiagnosticStatus::WARN);
  EXPECT_EQ(
      status.message,
      "scans waited too long for the IMU or the solver, and the oldest were dropped (max_queued_scans)");
  EXPECT_EQ(second(20, 20, 20).level, DiagnosticStatus::OK);
  monitor.dropped(0, "queue_full");
  EXPECT_EQ(input().message, "the IMU is silent, topic " + config.imu_topic);
}

TEST_F(TwoRadarDiagnostics, IsAnErrorIfTheImuFallsSilentOrCannotBeUsed) {
  const auto expectNoOdometry = [&](const std::string& because) {
    Status status;
    monitor.describeInput(status, &session);
    EXPECT_EQ(status.level, DiagnosticStatus::ERROR);
    EXPECT_EQ(status.message, because + ", topic " + config.imu_topic);
    const Status estimate = odometry(session);
    EXPECT_EQ(estimate.level, DiagnosticStatus::ERROR);
    EXPECT_EQ(estimate.message, because + ": no odometry is published");
  };
  second(20, 20, 20);
  for (int k = 0; k < 10; ++k) feed(0, true);
  expectNoOdometry("the IMU is silent");
  for (int k = 0; k < 10; ++k) {
    feed(0, true);
    monitor.imu();
    monitor.imuUnusable("imu_not_finite");
  }
  expectNoOdometry("no IMU message can be used (imu_not_finite)");
}

TEST_F(TwoRadarDiagnostics, AClockThatStandsIsNoFaultOfTheSensors) {
  second(20, 20, 20);
  LiveMonitor::RosView view;
  view.clock_stands = true;
  monitor.setRosView(view);
  EXPECT_EQ(input().level, DiagnosticStatus::WARN);
  EXPECT_NE(input().message.find("ROS time stands still"), std::string::npos);
  EXPECT_NE(odometry(session).message.find("ROS time stands still"), std::string::npos);
  monitor.setRosView({});
  EXPECT_EQ(input().message, "the IMU is silent, topic " + config.imu_topic);
}

/// The estimate runs, and the clock of a radar is far behind that of the IMU.
TEST_F(TwoRadarDiagnostics, NameScansThatAlwaysComeBeforeTheStart) {
  monitor.odometry(NavigationState(), 0.0);
  Status status;
  for (int k = 0; k < 5; ++k) {
    imuSample(Time::fromSeconds(1000.0 + k));
    for (int i = 0; i < 10; ++i) {
      feed(0, true);
      monitor.scan(1);
      monitor.trigger(1);
      LiveSession::Result result;
      result.result.scan.radar = 1;
      result.result.scan.stamp = Time::fromSeconds(10.0 + k);
      result.result.rejected_because = "before_initialization";
      monitor.result(result);
    }
    status = Status();
    monitor.describeInput(status, &session);
  }
  EXPECT_EQ(status.level, DiagnosticStatus::WARN);
  EXPECT_EQ(status.message,
            "radar right: 0 of the last 40 scans were used, rejected mostly as before_initialization");
  EXPECT_EQ(value(odometry(session), "likely_cause_1")
                .find("50 of 50 scans of radar right are stamped before the first IMU sample"),
            0U);
}

TEST_F(TwoRadarDiagnostics, SayHowTheOdometryGoesOnAfterAReset) {
  Status before;
  monitor.describeOdometry(before, &session);
  EXPECT_EQ(value(before, "after_reset"), "no after_reset");
  monitor.reset("~reset called");
  Status after;
  monitor.describeOdometry(after, &session);
  EXPECT_EQ(value(after, "after_reset"), "goes on from the last pose (reset_pose: keep)");
}

TEST_F(TwoRadarDiagnostics, AreAnErrorWithItsCauseWhereNoScanWasEverUsed) {
  const std::string cause =
      ". Likely cause: 30 of 30 scans of radar left show a velocity that contradicts the IMU. Check the "
      "mounting";
  for (int k = 0; k < 30; ++k) feed(0, false);
  rest(session, 4, 7);
  const Status coasts = odometry(session);
  EXPECT_EQ(coasts.level, DiagnosticStatus::ERROR);
  EXPECT_EQ(value(coasts, "health"), "coasting");
  EXPECT_EQ(coasts.message.find("no scan is used: the IMU alone carries the estimate" + cause), 0U)
      << coasts.message;
  OdometryOptions never_sure = config.odometry;
  never_sure.health.max_velocity_sigma = 1e-6;
  LiveSession diverged(config, never_sure);
  rest(diverged, 0, 4);
  const Status diverges = odometry(diverged);
  EXPECT_EQ(diverges.level, DiagnosticStatus::ERROR);
  EXPECT_EQ(value(diverges, "health"), "diverged");
  EXPECT_EQ(diverges.message.find("diverged: do not trust the estimate; re-initialising" + cause), 0U)
      << diverges.message;
}

TEST_F(TwoRadarDiagnostics, TakeTheShareOfFaultySamplesSinceTheReset) {
  for (int k = 0; k < 10000; ++k) imuSample();
  monitor.reset("~reset called");
  LiveSession fresh(config, config.odometry);
  rest(fresh, 0, 4);
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (int k = 0; k < 200; ++k)
    fresh.addImu({Time::fromSeconds(4.0 + 0.0025 * k), {kNan, 0.0, 0.0}, {0.0, 0.0, 9.81}});
  for (int k = 0; k < 1800; ++k) imuSample();
  EXPECT_EQ(value(odometry(fresh), "likely_cause_1").find("200 IMU samples are not finite."), 0U)
      << value(odometry(fresh), "likely_cause_1");
}

TEST_F(TwoRadarDiagnostics, DoubtARunWithManyImuMessagesThatCannotBeUsed) {
  const auto bad = [&](int count) {
    for (int k = 0; k < count; ++k) {
      monitor.imu();
      monitor.imuDropped(kImuNotUsable);
      monitor.imuUnusable("its stamp is zero");
    }
  };
  bad(1000);
  monitor.reset("~reset called");
  for (int k = 0; k < 30; ++k) feed(0, true);
  for (int k = 0; k < 800; ++k) imuSample();
  EXPECT_EQ(value(odometry(session), "verdict"), "good");
  bad(200);
  const Status status = odometry(session);
  EXPECT_EQ(value(status, "verdict"), "doubtful");
  EXPECT_EQ(value(status, "likely_cause_1").find("200 IMU messages cannot be used."), 0U)
      << value(status, "likely_cause_1");
}

TEST_F(TwoRadarDiagnostics, WarnOfARunThatIsDoubtfulForSeconds) {
  update(0, 0.31, 0.0, kMountings[0]);
  for (int k = 0; k < 1000; ++k) monitor.imuDropped(kImuNotUsable);
  EXPECT_EQ(odometry(session).message, "running");
  for (int k = 0; k < 5; ++k) odometry(session);
  const Status status = odometry(session);
  EXPECT_NE(value(status, "verdict"), "good");
  EXPECT_EQ(status.level, DiagnosticStatus::WARN);
  EXPECT_EQ(status.message.find("running, but the run is " + value(status, "verdict")), 0U);
}

/// Too few windows to name a cause.
TEST_F(TwoRadarDiagnostics, GiveTheNumberThatIsNotGoodIfThereIsNoCause) {
  LiveSession::Result result;
  result.result.used = result.result.updated = true;
  result.result.solver_termination = SolverTermination::kIterationLimit;
  for (int k = 0; k < 10; ++k) monitor.result(result);
  for (int k = 0; k < 1000; ++k) imuSample();
  Status status;
  for (int k = 0; k < 6; ++k) status = odometry(session);
  EXPECT_EQ(value(status, "likely_cause_1"), "no likely_cause_1");
  EXPECT_EQ(value(status, "red_check_1"), "windows_not_converged_share is 1, expected at most 0.3");
  EXPECT_EQ(status.level, DiagnosticStatus::WARN);
  EXPECT_EQ(status.message, "running, but the run is doubtful: " + value(status, "red_check_1"));
}

TEST_F(TwoRadarDiagnostics, ForgetANoisyImuOnceItIsConfiguredSo) {
  for (int k = 0; k < 30; ++k) feed(0, true);
  LiveSession noisy(config, config.odometry);
  for (int k = 0; k < 8000; ++k) {
    const double shake = k % 2 == 0 ? 1.0 : -1.0;  // [m/s^2] at 400 Hz: 0.05 m/s^2/sqrt(Hz)
    noisy.addImu({Time::fromSeconds(0.0025 * k), Eigen::Vector3d::Zero(), {shake, 0.0, 9.81}});
    imuSample();
  }
  bool more = false;
  noisy.process(&more);
  EXPECT_EQ(value(odometry(noisy), "likely_cause_1").find("The accelerometer vibrates or is noisier"), 0U)
      << value(odometry(noisy), "likely_cause_1");
  ImuNoise configured = config.odometry.imu_noise;
  configured.accel_density = 0.1;
  monitor.tune(configured);
  EXPECT_EQ(value(odometry(noisy), "likely_cause_1"), "no likely_cause_1");
}

TEST_F(TwoRadarDiagnostics, TellTheStateOfTheNewestImuSampleThoughNoScanComes) {
  NavigationState state;
  state.time = Time::fromSeconds(9.5);
  state.v_W = {3.0, 4.0, 0.0};
  state.covariance.diagonal().segment<3>(StateBlock::kV).setConstant(4.0);
  update(0, 3.5, 0.0, kMountings[0]);
  monitor.odometry(state, 0.001);
  const Status status = odometry(session);
  EXPECT_EQ(value(status, "speed_m_s"), "5");
  EXPECT_EQ(value(status, "velocity_sigma_m_s"), "2");
  EXPECT_EQ(value(status, "seconds_since_a_scan_was_used"), "6");
  monitor.reset("~reset called");
  EXPECT_EQ(value(odometry(session), "speed_m_s"), "no speed_m_s");
}

TEST_F(TwoRadarDiagnostics, IsAnErrorWhereNoRadarHasComeYet) {
  const Status status = second(0, 0, 0);
  EXPECT_EQ(status.level, DiagnosticStatus::ERROR);
  EXPECT_EQ(status.message, "radar left: no scan yet on /left; radar right: no scan yet on /right");
}

TEST_F(TwoRadarDiagnostics, NameTheTypeOfATopicThatIsPublishedAsAnother) {
  EXPECT_TRUE(monitor.lacksInput());
  LiveMonitor::RosView view;
  view.topic_types = {{config.imu_topic, "std_msgs/Header"},
                      {"/left", "sensor_msgs/PointCloud2"},
                      {"/right", "std_msgs/Header"}};
  monitor.setRosView(view);
  EXPECT_EQ(input().message, "no IMU message yet on " + config.imu_topic +
                                 ", which is published as std_msgs/Header, expected sensor_msgs/Imu");
  EXPECT_EQ(second(0, 0, 0).message,
            "radar left: no scan yet on /left; radar right: no scan yet on /right, which is published as "
            "std_msgs/Header, expected sensor_msgs/PointCloud2");
  EXPECT_EQ(second(20, 20, 20).level, DiagnosticStatus::OK);
  EXPECT_FALSE(monitor.lacksInput());
}

/// The name of the topic is the first thing that is wrong with a new radar.
TEST_F(TwoRadarDiagnostics, NameTheTopicsOfTheRightTypeIfNobodyPublishesTheConfiguredOne) {
  LiveMonitor::RosView view;
  view.topic_types = {{"/driver/cloud", "sensor_msgs/PointCloud2"},
                      {"/lidar", "sensor_msgs/PointCloud2"},
                      {"/left", "sensor_msgs/PointCloud2"},
                      {"/driver/imu", "sensor_msgs/Imu"}};
  monitor.setRosView(view);
  EXPECT_EQ(input().message, "no IMU message yet on " + config.imu_topic +
                                 ", which nobody publishes; topics of type sensor_msgs/Imu: /driver/imu");
  EXPECT_EQ(second(0, 0, 0).message,
            "radar left: no scan yet on /left; radar right: no scan yet on /right, which nobody publishes; "
            "topics of type sensor_msgs/PointCloud2: /driver/cloud, /left, /lidar");
}

TEST_F(TwoRadarDiagnostics, WarnOfATopicWithTwoPublishers) {
  setPublishers({{config.imu_topic, 2}, {"/left", 1}, {"/right", 1}});
  const Status status = second(20, 20, 20);
  EXPECT_EQ(status.level, DiagnosticStatus::WARN);
  EXPECT_EQ(status.message.find("topic " + config.imu_topic + " has 2 publishers"), 0U) << status.message;
  setPublishers({{config.imu_topic, 1}, {"/left", 1}, {"/right", 1}});
  EXPECT_EQ(second(20, 20, 20).level, DiagnosticStatus::OK);
}

/// rio_t.launch lets the player of a bag wait until all have subscribed.
TEST_F(TwoRadarDiagnostics, GiveTheClockOfABagTimeToBegin) {
  Status status;
  monitor.describeInput(status, &session);
  EXPECT_EQ(status.level, DiagnosticStatus::ERROR);
  EXPECT_FALSE(LiveMonitor::describeMissingClock(status, 5.0));
  EXPECT_EQ(status.level, DiagnosticStatus::WARN);
  EXPECT_EQ(status.message, "waits for /clock, since use_sim_time is true");
  Status late;
  monitor.describeInput(late, &session);
  EXPECT_TRUE(LiveMonitor::describeMissingClock(late, 11.0));
  EXPECT_EQ(late.level, DiagnosticStatus::ERROR);
  EXPECT_NE(late.message.find("nothing publishes /clock"), std::string::npos) << late.message;
}

TEST_F(TwoRadarDiagnostics, NameTheRadarThatIsMostlyRejected) {
  for (int k = 0; k < 5; ++k) EXPECT_EQ(second(20, 20, 10).level, DiagnosticStatus::OK) << "half are enough";
  Status status;
  monitor.dropped(1, "points_not_finite", 1000);  // these are no scans
  for (int k = 0; k < 4; ++k) status = second(20, 20, 5);
  EXPECT_EQ(status.level, DiagnosticStatus::WARN);
  EXPECT_EQ(status.message, "radar right: 20 of the last 80 scans were used, rejected mostly as innovation");
  for (int k = 0; k < 4; ++k) status = second(20, 20, 20);
  EXPECT_EQ(status.level, DiagnosticStatus::OK);
}

/// A cloud that cannot be read is nothing to "IMU and radar are coming".
TEST_F(TwoRadarDiagnostics, NameWhyTheScansOfTheOnlyRadarAreMostlyRejected) {
  LiveMonitor one{Config()};
  Status status;
  for (int k = 0; k < 5; ++k) {
    one.imu();
    one.imuUsable(Time());
    for (int i = 0; i < 10; ++i) {
      one.scan();
      one.dropped(0, "cloud_not_usable");
    }
    status = Status();
    one.describeInput(status, &session);
  }
  EXPECT_EQ(status.level, DiagnosticStatus::WARN);
  EXPECT_EQ(status.message, "0 of the last 40 scans were used, rejected mostly as cloud_not_usable");
}

/// A fault from earlier in the run may be over.
TEST_F(TwoRadarDiagnostics, SayWhatBecomesOfTheScansNowWhileTheImuCarriesTheEstimate) {
  for (int k = 0; k < 30; ++k) feed(0, false);
  second(20, 20, 20);
  rest(session, 4, 7);
  Status status = odometry(session);
  EXPECT_EQ(value(status, "health"), "coasting");
  EXPECT_EQ(status.message, "no scan is used: the IMU alone carries the estimate") << "the scans did come";
  for (int k = 0; k < 12; ++k) {
    monitor.scan(0);
    monitor.dropped(0, "cloud_not_usable");
  }
  imuSample();
  input();
  status = odometry(session);
  EXPECT_EQ(status.message,
            "no scan is used: the IMU alone carries the estimate; radar left: 0 of the last 12 scans were "
            "used, rejected mostly as cloud_not_usable; no scan comes on /right");
}

TEST_F(TwoRadarDiagnostics, SayThatScansAreUsedLate) {
  NavigationState newest;
  newest.time = Time::fromSeconds(7.0);
  monitor.odometry(newest, 0.0);
  second(20, 20, 20);  // stamped before 0.5 s
  rest(session, 4, 7);
  Status status = odometry(session);
  EXPECT_EQ(value(status, "health"), "coasting");
  EXPECT_EQ(status.level, DiagnosticStatus::ERROR);
  EXPECT_EQ(status.message.find("scans are used 6.6 s after their stamps"), 0U) << status.message;
  newest.time = Time::fromSeconds(8.5);
  monitor.odometry(newest, 0.0);
  status = odometry(session);
  EXPECT_EQ(status.message.find("no scan is used"), 0U) << "they have stopped: " << status.message;
}

/// An IMU that is doubtful, too, keeps no scans away.
TEST_F(TwoRadarDiagnostics, NameTheTopicsOfTheScansThatNeverCame) {
  for (int k = 0; k < 1000; ++k) monitor.imuDropped(kImuNotUsable);
  second(0, 0, 0);
  second(0, 0, 0);
  rest(session, 4, 7);
  const Status status = odometry(session);
  EXPECT_NE(value(status, "likely_cause_1"), "no likely_cause_1");
  EXPECT_EQ(status.message,
            "no scan is used: the IMU alone carries the estimate; no scan comes on /left; no scan comes on "
            "/right");
}

TEST_F(TwoRadarDiagnostics, AreNoWarningBeforeTheFirstScanOfARunIsUsed) {
  const Status status = odometry(session);
  EXPECT_EQ(status.level, DiagnosticStatus::OK);
  EXPECT_EQ(status.message, "initialised, no scan used yet");
}

TEST_F(TwoRadarDiagnostics, DoNotJudgeScansThatCameBeforeTheStart) {
  for (int k = 0; k < 20; ++k) {
    imuSample();
    for (int i = 0; i < 10; ++i) {
      for (const std::size_t radar : {0U, 1U}) {
        monitor.scan(radar);
        monitor.trigger(radar);
        LiveSession::Result result;
        result.result.scan.radar = radar;
        result.result.rejected_because = "before_initialization";
        monitor.result(result);
      }
    }
    Status status;
    monitor.describeInput(status, &session);
    EXPECT_EQ(status.level, DiagnosticStatus::OK) << status.message;
  }
}

TEST_F(TwoRadarDiagnostics, DoNotDoubtARunWhoseScansLongWaitedForTf) {
  for (const char* reason : {"scan_before_extrinsics", "frame_not_usable"}) monitor.dropped(0, reason, 100);
  for (int k = 0; k < 30; ++k) feed(0, true);
  for (int k = 0; k < 1600; ++k) imuSample();
  const Status status = odometry(session);
  EXPECT_EQ(value(status, "verdict"), "good");
  EXPECT_EQ(value(status, "likely_cause_1"), "no likely_cause_1");
}

TEST_F(TwoRadarDiagnostics, HaveATimeOffsetForEachRadar) {
  update(0, 9.0, 0.03, kMountings[0]);
  update(1, 9.5, -0.01, kMountings[1]);
  Status left, right;
  monitor.describeTimeOffset(left, 0);
  monitor.describeTimeOffset(right, 1);
  EXPECT_EQ(value(left, "offset_ms"), "30");
  EXPECT_EQ(value(right, "offset_ms"), "-10");
  EXPECT_EQ(left.message, "observed by the motion now");
  update(1, 12.0, -0.01, kMountings[1]);
  Status silent;
  monitor.describeTimeOffset(silent, 0);
  EXPECT_EQ(silent.message, "kept: no scan of radar left is used now");
  EXPECT_EQ(value(silent, "observable"), "false");
  monitor.reset("~reset called");
  Status fresh;
  monitor.describeTimeOffset(fresh, 0);
  EXPECT_EQ(fresh.message, "not estimated yet");
}

TEST_F(TwoRadarDiagnostics, TellTheMountingAgainstWhatWasTold) {
  EXPECT_EQ(extrinsics(1).message, "not estimated yet");
  const Extrinsics turned{kMountings[1].l_I + Eigen::Vector3d(0.0, 0.02, 0.0),
                          so3::exp({0.0, 0.05, 0.0}) * kMountings[1].q_IR};
  update(1, 9.0, 0.0, turned);
  const Status status = extrinsics(1);
  EXPECT_EQ(status.level, DiagnosticStatus::OK);
  EXPECT_EQ(status.message, "observed by the motion");
  double x = 1.0, y = 0.0, z = 1.0;
  ASSERT_EQ(std::sscanf(value(status, "turn_from_configured_deg").c_str(), "[%lf, %lf, %lf]", &x, &y, &z), 3);
  EXPECT_NEAR(x, 0.0, 1e-5);
  EXPECT_NEAR(y, 2.864789, 1e-4);
  EXPECT_NEAR(z, 0.0, 1e-5);
  ASSERT_EQ(std::sscanf(value(status, "lever_arm_from_configured_m").c_str(), "[%lf, %lf, %lf]", &x, &y, &z),
            3);
  EXPECT_NEAR(y, 0.02, 1e-6);
  ASSERT_EQ(std::sscanf(value(status, "turn_sigma_deg").c_str(), "[%lf, %lf, %lf]", &x, &y, &z), 3);
  EXPECT_NEAR(z, 1.145916, 1e-4);
  EXPECT_EQ(value(status, "lever_arm_sigma_m"), "[0.01, 0.01, 0.01]");
}

TEST_F(TwoRadarDiagnostics, SayWhichPartOfTheMountingTheMotionHasNotShown) {
  update(0, 9.0, 0.0, kMountings[0], 0.06, 0.01);
  EXPECT_EQ(extrinsics(0).message, "kept: the motion has not shown the turn about x, y, z");
  update(0, 9.1, 0.0, kMountings[0], 0.04, 0.03);
  EXPECT_EQ(extrinsics(0).message, "kept: the motion has not shown the lever arm along x, y, z");
}

TEST_F(TwoRadarDiagnostics, WarnOfAMountingFarFromWhatWasTold) {
  update(0, 9.0, 0.0, {kMountings[0].l_I, so3::exp({0.31, 0.0, 0.0}) * kMountings[0].q_IR});
  EXPECT_EQ(extrinsics(0).level, DiagnosticStatus::WARN);
  EXPECT_EQ(extrinsics(0).message,
            "the estimated rotation of radar left about x differs from the configured one by more than three "
            "sigmas, 17 degrees");
}

}  // namespace
}  // namespace rio_t
