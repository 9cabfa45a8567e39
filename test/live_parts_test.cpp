#include <diagnostic_msgs/DiagnosticStatus.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include "rio_t/core/so3.h"
#include "rio_t/ros/live/bounded_trajectory.h"
#include "rio_t/ros/live/current_session.h"
#include "rio_t/ros/live/monitor.h"
#include "rio_t/ros/live/offset_observability.h"
#include "rio_t/ros/live/publish_rate.h"
#include "rio_t/ros/live/session.h"

namespace rio_t {
namespace {

/// Ten scans a second, radar velocities with 0.05 m/s per axis, of a platform that accelerates.
bool observableAt(double acceleration, double yaw_rate, bool used = true, int rest_scans = 0) {
  OffsetObservability observability(1.0, 0.02);
  for (int k = 0; k < 20 + rest_scans; ++k) {
    const double t = 0.1 * k;
    const double moved = 0.1 * std::min(k, 20);
    ScanResult result;
    result.updated = true;
    result.used = used;
    result.state.time = Time::fromSeconds(t);
    result.state.q_WI = Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rate * moved, Eigen::Vector3d::UnitZ()));
    result.state.v_W = Eigen::Vector3d(1.0 + acceleration * moved, 0.0, 0.0);
    result.ego_velocity.covariance = 0.0025 * Eigen::Matrix3d::Identity();
    observability.add(result);
  }
  return observability.observable();
}

TEST(OffsetObservability, AccelerationShowsTheOffset) {
  // 0.05 m/s over sqrt(10) scans against |a| * 0.02 s: enough from 0.79 m/s^2 on.
  EXPECT_TRUE(observableAt(1.0, 0.0));
  EXPECT_FALSE(observableAt(0.6, 0.0));
}

TEST(OffsetObservability, ConstantVelocityShowsNothing) { EXPECT_FALSE(observableAt(0.0, 0.0)); }

TEST(OffsetObservability, TurningAtSpeedShowsTheOffset) { EXPECT_TRUE(observableAt(0.0, 1.0)); }

TEST(OffsetObservability, RejectedScansShowNothing) { EXPECT_FALSE(observableAt(2.0, 0.0, false)); }

TEST(OffsetObservability, IsOfTheLastSecondOnly) {
  EXPECT_TRUE(observableAt(2.0, 0.0, true, 5));
  EXPECT_FALSE(observableAt(2.0, 0.0, true, 15));
}

CurrentSession::Session freshSession() { return std::make_shared<LiveSession>(Config(), Config().odometry); }

TEST(CurrentSession, NothingIsSaidForASessionThatWasReplaced) {
  CurrentSession current;
  const auto old = freshSession();
  EXPECT_FALSE(current.replace(old));
  int said = 0;
  const auto speak = [&](const CurrentSession::Session& session) {
    return current.speak(CurrentSession::Speaker::kOptimisation, session, [&] { ++said; });
  };
  EXPECT_TRUE(speak(old));
  EXPECT_EQ(current.replace(freshSession()), old);
  EXPECT_FALSE(speak(old));
  EXPECT_TRUE(speak(current.get()));
  EXPECT_EQ(said, 2);
}

TEST(CurrentSession, ReplacingWaitsForWhoIsSpeaking) {
  for (const auto speaker : {CurrentSession::Speaker::kNavigation, CurrentSession::Speaker::kOptimisation}) {
    CurrentSession current;
    const auto old = freshSession();
    current.replace(old);
    std::future<CurrentSession::Session> replaced;
    current.speak(speaker, old, [&] {
      replaced = std::async(std::launch::async, [&] { return current.replace(freshSession()); });
      // A replacement that does not wait is there within microseconds.
      EXPECT_EQ(replaced.wait_for(std::chrono::milliseconds(200)), std::future_status::timeout);
      EXPECT_EQ(current.get(), old);
    });
    EXPECT_EQ(replaced.get(), old) << "it must come once nobody speaks";
  }
}

TEST(CurrentSession, SpeakersDoNotWaitForEachOther) {
  CurrentSession current;
  const auto session = freshSession();
  current.replace(session);
  bool both = false;
  current.speak(CurrentSession::Speaker::kOptimisation, session, [&] {
    std::thread([&] { both = current.speak(CurrentSession::Speaker::kNavigation, session, [] {}); }).join();
  });
  EXPECT_TRUE(both);
}

TEST(LiveSession, TellsWhenTheImuPilesUpBeforeAStuckOptimisation) {
  const auto session = freshSession();
  int k = 0;
  const auto feed = [&](std::size_t count) {
    for (std::size_t i = 0; i < count; ++i)
      session->addImu({Time::fromSeconds(0.0025 * ++k), Eigen::Vector3d::Zero(), {0.0, 0.0, 9.81}});
  };
  feed(LiveSession::kMaxWaitingImu - 1);
  EXPECT_FALSE(session->imuPilesUp());
  feed(1);
  EXPECT_TRUE(session->imuPilesUp());
  bool more = false;
  session->process(&more);
  EXPECT_FALSE(session->imuPilesUp());
  feed(LiveSession::kMaxWaitingImu - 1);
  EXPECT_FALSE(session->imuPilesUp());
}

const std::vector<Extrinsics> kMountings = {{{1.0, 0.3, 0.0}, so3::exp({0.0, 0.0, 0.5})},
                                            {{1.0, -0.3, 0.0}, so3::exp({0.0, 0.0, -0.5})}};

/// Radars left, with header stamps, and right, with triggers. Both mountings are estimated.
Config twoRadars() {
  std::vector<std::string> texts = {"radars=[left, right]",
                                    "left/radar_topic=/left",
                                    "right/radar_topic=/right",
                                    "right/stamp_source=trigger",
                                    "right/trigger_topic=/right/trigger",
                                    "estimate_extrinsics=pose",
                                    "extrinsics_rotation_sigma=0.1",
                                    "extrinsics_translation_sigma=0.05"};
  ParameterEntries entries;
  for (const std::string& text : texts) entries.push_back(parseAssignment(text));
  Config config = makeConfig(entries);
  for (std::size_t k = 0; k < 2; ++k)
    config.radars[k].odometry.T_IR = config.odometry.radars[k].T_IR = kMountings[k];
  return config;
}

RadarScan scanOf(std::size_t radar) {
  RadarScan scan;
  scan.radar = radar;
  return scan;
}

TEST(LiveSession, StampsTheScansOfEachRadarInItsOwnWay) {
  const Config config = twoRadars();
  LiveSession session(config, config.odometry);
  const Time stamp = Time::fromSeconds(10.0), record = Time::fromSeconds(10.05);
  EXPECT_EQ(session.addScan(7, stamp, record, scanOf(0)).queued, 1U);
  EXPECT_EQ(session.addScan(7, stamp, record, scanOf(1)).queued, 0U) << "it has no trigger yet";
  EXPECT_EQ(session.addTrigger(0, 7, stamp, record).queued, 0U) << "not its trigger";
  EXPECT_EQ(session.addTrigger(1, 7, stamp, record).queued, 1U);
}

TEST(LiveSession, NamesTheRadarWhoseScanGetsNoStamp) {
  const Config config = twoRadars();
  LiveSession session(config, config.odometry);
  const auto at = [](double seconds) { return Time::fromSeconds(seconds); };
  session.addScan(1, at(10.0), at(10.0), scanOf(1));
  const LiveSession::Stamped left = session.addScan(1, at(10.0), at(10.0), scanOf(0));
  EXPECT_EQ(left.queued, 1U);
  EXPECT_TRUE(left.given_up.empty());
  const LiveSession::Stamped late = session.addScan(2, at(20.0), at(20.0), scanOf(1));
  ASSERT_EQ(late.given_up.size(), 1U);
  EXPECT_EQ(late.given_up[0].radar, 1U);
  EXPECT_EQ(late.given_up[0].reason, "trigger_missing");
}

TEST(LiveSession, TakesOneScanAtATimeAndDropsTheOldestOfTooMany) {
  Config config = twoRadars();
  config.odometry.max_queued_scans = 1;
  LiveSession session(config, config.odometry);
  for (int k = 0; k < 4; ++k) {
    const Time stamp = Time::fromSeconds(10.0 + k);
    session.addScan(static_cast<std::uint32_t>(k), stamp, stamp, scanOf(0));
  }
  bool more = false;
  const std::vector<LiveSession::Result> results = session.process(&more);
  // One is used, so that a reset waits for one solution alone; one may wait; the two between them go.
  ASSERT_EQ(results.size(), 3U);
  EXPECT_TRUE(more);
  EXPECT_EQ(results[0].result.rejected_because, "before_initialization");
  for (const std::size_t k : {1U, 2U}) {
    EXPECT_EQ(results[k].result.rejected_because, "queue_full");
    EXPECT_EQ(results[k].result.scan.stamp, Time::fromSeconds(10.0 + static_cast<double>(k)));
  }
  EXPECT_EQ(session.process(&more).size(), 1U);
  EXPECT_TRUE(session.process(&more).empty());
  EXPECT_FALSE(more);
}

TEST(LiveSession, KnowsNoTimeOfMeasurementBeforeThereIsAnOffset) {
  const Config config = twoRadars();
  LiveSession session(config, config.odometry);
  const Time stamp = Time::fromSeconds(10.0);
  session.addScan(1, stamp, stamp, scanOf(0));
  bool more = false;
  EXPECT_EQ(session.process(&more).at(0).measured_at, stamp);
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

TEST(LiveSession, ResultsHaveTheMountingOfTheirRadarAsTold) {
  const Config config = twoRadars();
  LiveSession session(config, config.odometry);
  for (const std::size_t radar : {1U, 0U}) {
    RadarScan scan = scanOf(radar);
    const Time stamp = Time::fromSeconds(10.0);  // both have the same
    if (radar == 0) {
      session.addScan(1, stamp, stamp, scan);
    } else {
      session.addTrigger(1, 1, stamp, stamp);
      session.addScan(1, stamp, stamp, scan);
    }
    bool more = false;
    const std::vector<LiveSession::Result> results = session.process(&more);
    ASSERT_EQ(results.size(), 1U);
    EXPECT_EQ(results[0].result.scan.radar, radar);
    EXPECT_EQ(results[0].T_IR.l_I, kMountings[radar].l_I);
    EXPECT_GT(results[0].latency, 0.0);
  }
}

/// What `diagnostics` says of two radars.
class TwoRadarDiagnostics : public testing::Test {
 protected:
  using Status = LiveMonitor::Status;

  TwoRadarDiagnostics() {
    monitor.startWith(kMountings);
    // A session that is initialised: four seconds of rest.
    for (int k = 0; k <= 1600; ++k)
      session.addImu({Time::fromSeconds(0.0025 * k), Eigen::Vector3d::Zero(), {0.0, 0.0, 9.81}});
    bool more = false;
    session.process(&more);
  }

  static std::string value(const Status& status, const std::string& key) {
    for (const auto& each : status.values)
      if (each.key == key) return each.value;
    return "no " + key;
  }
  /// A second in which the IMU and these numbers of scans come; so many of those of right are used.
  Status second(int left, int right, int right_used) {
    monitor.imu();
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
    result.result.scan.stamp = Time::fromSeconds(stamp);
    result.result.used = result.result.updated = true;
    result.result.time_offset = offset;
    result.result.T_IR = T_IR;
    result.result.T_IR_covariance.diagonal().head<3>().setConstant(lever_sigma * lever_sigma);
    result.result.T_IR_covariance.diagonal().tail<3>().setConstant(turn_sigma * turn_sigma);
    result.offset_observable = true;
    monitor.result(result);
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

using diagnostic_msgs::DiagnosticStatus;

TEST_F(TwoRadarDiagnostics, CountForEachRadar) {
  ASSERT_TRUE(session.odometry().initialized());
  monitor.dropped(0, "scan_not_usable");
  const Status status = second(20, 10, 9);
  EXPECT_EQ(status.level, DiagnosticStatus::OK) << status.message;
  EXPECT_EQ(value(status, "left/scans"), "20");
  EXPECT_EQ(value(status, "right/scans"), "10");
  EXPECT_EQ(value(status, "right/scans_used"), "9");
  EXPECT_EQ(value(status, "left/dropped_scan_not_usable"), "1");
  EXPECT_EQ(value(status, "right/dropped_innovation"), "1");
  EXPECT_EQ(value(status, "left/triggers"), "no left/triggers") << "it needs none";
}

TEST_F(TwoRadarDiagnostics, NameTheRadarThatIsSilent) {
  const Status never = second(20, 0, 0);
  EXPECT_EQ(never.level, DiagnosticStatus::WARN) << "the other one works";
  EXPECT_EQ(never.message, "radar right: no scan yet on /right");
  second(20, 20, 20);
  const Status silent = second(20, 0, 0);
  EXPECT_EQ(silent.level, DiagnosticStatus::WARN);
  EXPECT_EQ(silent.message, "radar right is silent, topic /right");
  EXPECT_EQ(second(20, 20, 20).level, DiagnosticStatus::OK);
}

TEST_F(TwoRadarDiagnostics, IsAnErrorIfTheImuFallsSilent) {
  second(20, 20, 20);
  for (int k = 0; k < 10; ++k) feed(0, true);
  Status status;
  monitor.describeInput(status, &session);
  EXPECT_EQ(status.level, DiagnosticStatus::ERROR);
  EXPECT_EQ(status.message, "the IMU is silent, topic " + config.imu_topic);
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

TEST_F(TwoRadarDiagnostics, IsAnErrorWhereNoRadarHasComeYet) {
  const Status status = second(0, 0, 0);
  EXPECT_EQ(status.level, DiagnosticStatus::ERROR);
  EXPECT_EQ(status.message, "radar left: no scan yet on /left; radar right: no scan yet on /right");
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

TEST_F(TwoRadarDiagnostics, DoNotJudgeScansThatCameBeforeTheStart) {
  for (int k = 0; k < 20; ++k) {
    monitor.imu();
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
  ASSERT_EQ(std::sscanf(value(status, "turn_from_told_deg").c_str(), "[%lf, %lf, %lf]", &x, &y, &z), 3);
  EXPECT_NEAR(x, 0.0, 1e-5);
  EXPECT_NEAR(y, 2.864789, 1e-4);
  EXPECT_NEAR(z, 0.0, 1e-5);
  ASSERT_EQ(std::sscanf(value(status, "lever_arm_from_told_m").c_str(), "[%lf, %lf, %lf]", &x, &y, &z), 3);
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
            "radar left is turned about x by more than 3 extrinsics_rotation_sigma from what was told");
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
  std::string at_bound;
  for (const auto& value : status().values)
    if (value.key == "at_bound") at_bound = value.value;
  EXPECT_EQ(at_bound, "20");
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

}  // namespace
}  // namespace rio_t
