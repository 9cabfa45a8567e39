#include <diagnostic_msgs/DiagnosticStatus.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "rio_t/ros/live/bounded_trajectory.h"
#include "rio_t/ros/live/current_session.h"
#include "rio_t/ros/live/monitor.h"
#include "rio_t/ros/live/offset_observability.h"
#include "rio_t/ros/live/scan_queue.h"
#include "rio_t/ros/live/session.h"

namespace rio_t {
namespace {

ScanQueue::Item scanAt(double seconds) {
  ScanQueue::Item item;
  item.scan.stamp = Time::fromSeconds(seconds);
  return item;
}

TEST(ScanQueue, GivesScansInOrderAndReportsTheOldestAsItGoes) {
  ScanQueue queue(2);
  EXPECT_FALSE(queue.pop());
  EXPECT_FALSE(queue.push(scanAt(1.0)));
  EXPECT_FALSE(queue.push(scanAt(2.0)));
  const std::optional<RadarScan> dropped = queue.push(scanAt(3.0));
  ASSERT_TRUE(dropped);
  EXPECT_EQ(dropped->stamp, Time::fromSeconds(1.0));
  EXPECT_EQ(queue.size(), 2U);
  EXPECT_EQ(queue.pop()->scan.stamp, Time::fromSeconds(2.0));
  EXPECT_EQ(queue.pop()->scan.stamp, Time::fromSeconds(3.0));
  EXPECT_FALSE(queue.pop());
}

TEST(ScanQueue, RefusesToHoldNothing) { EXPECT_THROW(ScanQueue(0), std::invalid_argument); }

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
    std::atomic<bool> speaking{false}, replaced{false};
    bool replaced_meanwhile = false;
    std::thread thread([&] {
      current.speak(speaker, old, [&] {
        speaking = true;
        // Long enough for a replacement that does not wait.
        for (int k = 0; k < 2000; ++k) std::this_thread::yield();
        replaced_meanwhile = replaced;
      });
    });
    while (!speaking) std::this_thread::yield();
    current.replace(freshSession());
    replaced = true;
    thread.join();
    EXPECT_FALSE(replaced_meanwhile);
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
    monitor.describeSolver(status, nullptr);
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
