// The collector counts the time without scans and the scans before a start.
#include "rio_t/ros/diagnosis/run_evidence.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <optional>

namespace rio_t {
namespace {

/// Seconds of states at 10 Hz from `from` on, with a scan after each of those before `heard_until`.
void feed(EvidenceCollector& collector, double from, double heard_until, double to) {
  const int states = static_cast<int>(std::lround(10.0 * (to - from)));
  for (int k = 0; k <= states; ++k) {
    const Time time = Time::fromSeconds(from + 0.1 * k);
    collector.addState(time);
    ScanResult result;
    result.scan.stamp = time;
    result.used = true;
    if (time < Time::fromSeconds(heard_until)) collector.add(result);
  }
}

TEST(EvidenceCollector, TheTimeWithoutScansIsCounted) {
  const Config config;
  const RadarInertialOdometry odometry(config.odometry);
  EvidenceCollector collector(config);
  feed(collector, 100.0, 105.05, 120.0);
  RunEvidence evidence = collector.evidence(odometry, std::nullopt);
  EXPECT_NEAR(evidence.run_seconds, 20.0, 1e-6);
  EXPECT_NEAR(evidence.silent_seconds, 14.0, 0.11) << "it coasts from one second after the last scan on";
  EXPECT_NEAR(evidence.silence_begin, 5.0, 1e-6);
  EXPECT_NEAR(evidence.silence_end, 20.0, 1e-6);
  feed(collector, 50.0, 70.0, 60.0);  // the clock jumped back, and no time went by
  evidence = collector.evidence(odometry, std::nullopt);
  EXPECT_NEAR(evidence.run_seconds, 30.0, 1e-6);
  EXPECT_NEAR(evidence.silent_seconds, 14.0, 0.11);
  ScanResult at_rest;
  at_rest.scan.stamp = Time::fromSeconds(69.9);
  at_rest.rejected_because = "too_few_points";
  at_rest.at_rest = true;
  collector.add(at_rest);
  feed(collector, 60.1, 0.0, 70.0);
  EXPECT_NEAR(collector.evidence(odometry, std::nullopt).silent_seconds, 14.0, 0.11) << "it stands still";
}

TEST(EvidenceCollector, ScansThatComeLateAreNoSilence) {
  const Config config;
  const RadarInertialOdometry odometry(config.odometry);
  EvidenceCollector collector(config);
  for (int k = 0; k <= 200; ++k) {
    collector.addState(Time::fromSeconds(100.0 + 0.1 * k));
    ScanResult late;
    late.scan.stamp = Time::fromSeconds(98.5 + 0.1 * k);
    late.used = true;
    collector.add(late);
  }
  EXPECT_EQ(collector.evidence(odometry, std::nullopt).silent_seconds, 0.0);
}

TEST(EvidenceCollector, ScansBeforeASecondStartCount) {
  Config config;
  EvidenceCollector collector(config);
  ScanResult result;
  result.rejected_because = "before_initialization";
  // All clocks jump back by 80 s.
  for (const double second : {100.0, 20.0}) {
    collector.addImu(Time::fromSeconds(second));
    for (int k = 0; k < 30; ++k) {
      result.scan.stamp = Time::fromSeconds(second + 0.1 * k);
      collector.add(result);
    }
  }
  const RunEvidence evidence = collector.evidence(RadarInertialOdometry(config.odometry), std::nullopt);
  EXPECT_EQ(evidence.radars[0].scans_before_start, 60u);
  EXPECT_EQ(evidence.radars[0].scans_before_imu, 0u);
}

TEST(EvidenceCollector, ScansWithoutPointsAreCountedByTheirReason) {
  const Config config;
  EvidenceCollector collector(config);
  ScanResult result;
  result.rejected_because = "too_few_points";
  collector.add(result);
  RadarPoint behind, ahead;
  behind.position_R = {0.0, -5.0, 0.0};
  ahead.position_R = {0.0, 5.0, 0.0};
  behind.snr_db = ahead.snr_db = 20.0;
  result.scan.points = {behind, behind, behind, ahead};
  collector.add(result);
  result.scan.points = {ahead, ahead};  // too few came
  collector.add(result);
  result.scan.points = {ahead, ahead, ahead, behind};
  collector.add(result);
  const RunEvidence evidence = collector.evidence(RadarInertialOdometry(config.odometry), std::nullopt);
  const RadarSummary& radar = evidence.radars.front();
  EXPECT_EQ(radar.scans_empty, 1U);
  EXPECT_EQ(radar.scans_emptied[static_cast<std::size_t>(PointVerdict::kBesideView)], 1U);
  EXPECT_EQ(std::accumulate(radar.scans_emptied.begin(), radar.scans_emptied.end(), std::uint64_t{0}), 1U);
  EXPECT_EQ(radar.points, 10U);
}

TEST(EvidenceCollector, DopplersAndFastMotionAreCounted) {
  const Config config;
  EvidenceCollector collector(config);
  ScanResult result;
  result.used = result.updated = true;
  RadarPoint still, moving;
  moving.doppler = -0.125;
  result.scan.points = {still, moving, still};
  result.state.v_W = {0.3, 0.0, -0.3};  // a radar with a large step may not show it
  collector.add(result);
  result.state.v_W = {0.4, 0.0, -0.4};
  collector.add(result);
  const RunEvidence evidence = collector.evidence(RadarInertialOdometry(config.odometry), std::nullopt);
  EXPECT_EQ(evidence.radars.front().points_with_doppler, 2U);
  EXPECT_EQ(evidence.radars.front().scans_fast, 1U);
}

}  // namespace
}  // namespace rio_t
