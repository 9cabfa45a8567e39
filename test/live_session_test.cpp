// The session of the live node: its scans and stamps, and who may speak for it.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "rio_t/radar/scan.h"
#include "rio_t/ros/live/session.h"
#include "two_radars_config.h"

namespace rio_t {
namespace {

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

RadarScan scanOf(std::size_t radar) {
  RadarScan scan;
  scan.radar = radar;
  return scan;
}

/// How many scans got their stamp since the last call.
std::size_t stampedScans(LiveSession& session) {
  std::size_t count = 0;
  for (bool more = true; more;) count += session.process(&more).size();
  return count;
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

TEST(LiveSession, StampsTheScansOfEachRadarInItsOwnWay) {
  const Config config = twoRadars();
  LiveSession session(config, config.odometry);
  const Time stamp = Time::fromSeconds(10.0), record = Time::fromSeconds(10.05);
  session.addScan(7, stamp, record, scanOf(0));
  EXPECT_EQ(stampedScans(session), 1U);
  session.addScan(7, stamp, record, scanOf(1));
  EXPECT_EQ(stampedScans(session), 0U) << "it has no trigger yet";
  session.addTrigger(0, 7, stamp, record);
  EXPECT_EQ(stampedScans(session), 0U) << "not its trigger";
  session.addTrigger(1, 7, stamp, record);
  EXPECT_EQ(stampedScans(session), 1U);
}

TEST(LiveSession, NamesTheRadarWhoseScanGetsNoStamp) {
  const Config config = twoRadars();
  LiveSession session(config, config.odometry);
  const auto at = [](double seconds) { return Time::fromSeconds(seconds); };
  session.addScan(1, at(10.0), at(10.0), scanOf(1));
  EXPECT_TRUE(session.addScan(1, at(10.0), at(10.0), scanOf(0)).empty());
  const std::vector<LiveSession::GivenUp> late = session.addScan(2, at(20.0), at(20.0), scanOf(1));
  ASSERT_EQ(late.size(), 1U);
  EXPECT_EQ(late[0].radar, 1U);
  EXPECT_EQ(late[0].reason, "trigger_missing");
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

TEST(LiveSession, KeepsThePosesThatLeftTheWindowDuringASilenceThoughTheNextScanIsRejected) {
  LiveSession session(Config(), Config().odometry);
  const auto scanAt = [](double seconds) {
    RadarScan scan;
    scan.stamp = Time::fromSeconds(seconds);
    for (int i = 0; i < 30; ++i) {
      const double azimuth = 0.9 * std::sin(1.0 + 2.4 * i);
      scan.points.push_back(
          {{4.0 * std::sin(azimuth), 4.0 * std::cos(azimuth), 1.5 * std::sin(0.7 * i)}, 0.0, 20.0});
    }
    return scan;
  };
  const auto add = [&](double stamp) {
    session.addScan(0, Time::fromSeconds(stamp), Time::fromSeconds(stamp), scanAt(stamp));
  };
  std::size_t used = 0;
  const auto process = [&] {
    std::string rejected_because;
    for (bool more = true; more;) {
      for (const LiveSession::Result& result : session.process(&more)) {
        used += result.result.used ? 1 : 0;
        rejected_because = result.result.rejected_because;
      }
    }
    return rejected_because;
  };
  for (int k = 0; k < 30 * 200; ++k) {
    const double t = 1.0 + 0.005 * k;
    session.addImu({Time::fromSeconds(t), Eigen::Vector3d::Zero(), {0.0, 0.0, 9.81}});
    if (t <= 7.0 && k % 20 == 0) add(t);
    if (k % 10 == 0) process();
  }
  ASSERT_GT(used, 10U);
  add(5.005);
  EXPECT_EQ(process(), "older_than_window");
  const Trajectory kept = session.trajectory();
  ASSERT_FALSE(kept.empty());
  EXPECT_GT(kept.back().time, Time::fromSeconds(10.0)) << "the last scan is of 7 s";
  for (std::size_t k = 1; k < kept.size(); ++k) {
    EXPECT_GT(kept[k].time, kept[k - 1].time);
    EXPECT_LE(kept[k].time - kept[k - 1].time, 5.0) << "kSilentStep of the estimator";
  }
}

}  // namespace
}  // namespace rio_t
