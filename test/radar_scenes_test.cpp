// The whole pipeline on radars that see little, and on scenes that are hard.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "rio_t/odometry/radar_inertial_odometry.h"
#include "simulated_run.h"

namespace rio_t {
namespace {

/// Three points agree on some velocity whatever they are; only what the IMU predicts tells them.
/// All but the first scans borrow points, which nobody outside of the estimator has.
TEST(FewPoints, AreReportedWithoutThoseBorrowed) {
  SimulatedRun run("medium", 1, 20.0, 5.0);
  run.setup.radar.points_mean = 6.0;
  run.setup.radar.points_sigma = 1.0;
  run.setup.radar.points_max = 8;
  run.run();
  std::size_t with_velocity = 0;
  for (const ScanResult& result : run.results) {
    const std::size_t all = result.scan.points.size();
    ASSERT_LE(result.ego_velocity.points.size(), all);
    ASSERT_LE(result.ego_velocity.inliers.size(), result.ego_velocity.points.size());
    for (const std::size_t i : result.ego_velocity.inliers) ASSERT_LT(i, all);
    with_velocity += isValid(result.ego_velocity.status) ? 1 : 0;
  }
  EXPECT_GT(with_velocity, run.results.size() / 2);
}

SimulatedRun threePoints(std::uint64_t seed) {
  SimulatedRun run("medium", seed, 60.0, 5.0);
  run.options.smoother.radar_factor = RadarFactor::kDoppler;
  run.setup.radar.points_mean = 3.0;
  run.setup.radar.points_sigma = 0.7;
  run.setup.radar.points_min = 2;
  run.setup.radar.points_max = 4;
  return run;
}

bool keepsTheVelocity(const SimulatedRun& run) {
  std::size_t used = 0;
  for (const ScanResult& result : run.results) used += result.used ? 1 : 0;
  return used > run.results.size() / 2 &&
         run.rms(10.0, 60.0, [&](const NavigationState& state) { return run.velocityError(state); }) < 0.1;
}

TEST(FewPoints, KeepTheVelocity) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    SimulatedRun run = threePoints(seed);
    run.setup.radar.moving_share = 0.0;
    run.run();
    EXPECT_TRUE(keepsTheVelocity(run)) << "seed " << seed;
    EXPECT_EQ(run.odometry->faults()["diverged"], 0u) << "seed " << seed;
  }
}

/// A person in view may well be all of the points, and then no estimate can be right.
TEST(FewPoints, MostlyKeepTheVelocityAmongPersons) {
  int kept = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SimulatedRun run = threePoints(seed);
    run.run();
    kept += keepsTheVelocity(run) ? 1 : 0;
  }
  EXPECT_GE(kept, 6);
}

/// One row of antennas: all points in a plane, and what they see of the vertical is nothing.
SimulatedRun flatRadar(const std::string& motion, std::uint64_t seed) {
  SimulatedRun run(motion, seed, 60.0, 5.0);
  run.setup.radar.measures_elevation = false;
  run.setup.radar.fov_elevation = 10.0;
  return run;
}

double shareUsed(const SimulatedRun& run, double from) {
  double used = 0.0, all = 0.0;
  for (const ScanResult& result : run.results) {
    if (run.seconds(result.scan.stamp) < from) continue;
    all += 1.0;
    used += result.used ? 1.0 : 0.0;
  }
  return used / all;
}

/// [m/s] In the axes of the true heading.
double horizontalError(const SimulatedRun& run, const NavigationState& state) {
  const simulation::MotionState truth = run.truth(state);
  const Eigen::Vector3d e = truth.q_WI.conjugate() * truth.v_W - state.q_WI.conjugate() * state.v_W;
  return (truth.q_WI * e).head<2>().norm();
}

TEST(FlatRadar, KeepsTheVelocity) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    SimulatedRun run = flatRadar("medium", seed);
    run.run();
    EXPECT_GT(shareUsed(run, 0.0), 0.5) << "seed " << seed;
    EXPECT_EQ(run.odometry->faults()["diverged"], 0u) << "seed " << seed;
    const auto error = [&](const NavigationState& state) { return horizontalError(run, state); };
    EXPECT_LT(run.rms(10.0, 60.0, error), 0.1) << "seed " << seed;
  }
}

/// After a gap of the IMU the vertical velocity is unknown for good. The rest is not.
TEST(FlatRadar, IsUsedIfOnlyTheVerticalVelocityIsUnknown) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    SimulatedRun run = flatRadar("ground_vehicle", seed);
    run.run([&](simulation::SensorData& data) {
      auto& samples = data.imu.samples;
      samples.erase(std::remove_if(samples.begin(), samples.end(),
                                   [&](const ImuMeasurement& sample) {
                                     const double t = run.seconds(sample.time);
                                     return 20.0 < t && t < 21.0;
                                   }),
                    samples.end());
    });
    EXPECT_GT(shareUsed(run, 22.0), 0.8) << "seed " << seed;
    const auto error = [&](const NavigationState& state) { return horizontalError(run, state); };
    EXPECT_LT(run.rms(23.0, 60.0, error), 0.3) << "seed " << seed;
  }
}

/// A driver that removes what stands still sends empty scans, and so does a radar with a covered lens. The
/// next scan always waits already.
TEST(EmptyScans, DoNotHoldTheWindow) {
  SimulatedRun run("medium", 1, 60.0, 5.0);
  run.setup.radar.rate = 20.0;
  run.run([&](simulation::SensorData& data) {
    for (simulation::SimulatedScan& scan : data.scans)
      if (run.seconds(scan.stamp) > 20.0 && run.seconds(scan.stamp) < 50.0) scan.points.clear();
  });
  std::vector<Time> left;
  for (const ScanResult& result : run.results)
    for (const StampedPose& pose : result.left_window) left.push_back(pose.time);
  ASSERT_FALSE(left.empty());
  EXPECT_GT(run.seconds(left.back()), 55.0);
  // A window that stood still would keep all of the IMU since the last used scan.
  for (std::size_t i = 1; i < left.size(); ++i) EXPECT_LT(left[i] - left[i - 1], 5.1) << run.seconds(left[i]);
}

/// A borrowed Doppler has the change of the velocity in it: it may lie beyond what the radar can report.
TEST(FewPoints, ShowTheSpanOfTheirOwnDopplersOnly) {
  SimulatedRun run("drone", 1, 60.0, 5.0);
  run.setup.radar.rate = 20.0;
  run.setup.radar.points_mean = 9.0;
  run.setup.radar.points_sigma = 2.0;
  run.setup.radar.doppler_step = 0.125;
  run.setup.radar.doppler_span = 3.0;
  run.run();
  std::size_t refused = 0;
  for (const ScanResult& result : run.results)
    if (run.seconds(result.scan.stamp) > 20.0 && result.rejected_because == "too_few_inliers") ++refused;
  EXPECT_LT(refused, 30u);
}

/// Before the start there is no estimate that could show the span, and wrapped Dopplers give no start.
TEST(Aliasing, ShowsItsSpanBeforeAStartInMotion) {
  SimulatedRun run("ground_vehicle", 2, 30.0, 0.0);
  run.setup.radar.doppler_span = 4.0;
  run.run();
  EXPECT_EQ(run.odometry->radarKnowledge().doppler_span.source, DopplerSource::kData);
  EXPECT_NEAR(run.odometry->radarKnowledge().doppler_span.value, 4.0, 1e-6);
  ASSERT_TRUE(run.odometry->start());
  EXPECT_EQ(run.odometry->start()->from, InitializedFrom::kMotion);
  EXPECT_LT(run.seconds(run.odometry->start()->time), 10.0);
  EXPECT_LT(run.rms(10.0, 30.0, [&](const NavigationState& state) { return run.velocityError(state); }), 0.2);
  for (const ScanResult& result : run.results) ASSERT_NE(result.health, Health::kDiverged);
}

/// The points that read the next bin tell the speed. A velocity fitted to all points leaves them out, or
/// takes them for noise.
TEST(CoarseRadar, TellsTheSpeedByTheEdgesOfItsBins) {
  for (const double points : {20.0, 80.0}) {
    SimulatedRun run("kart", 5, 60.0, 8.0);
    simulation::RadarModelOptions& radar = run.setup.radar;
    radar.rate = 30.0;
    radar.points_mean = points;
    radar.points_max = 200;
    radar.fov_azimuth = 30.0;
    radar.fov_elevation = 20.0;
    radar.azimuth_noise = 0.5;
    radar.elevation_noise = 1.0;
    radar.doppler_noise = 0.03;
    radar.doppler_step = 0.49;
    run.run();
    const auto error = [&](const NavigationState& state) { return run.velocityError(state); };
    EXPECT_LT(run.rms(25.0, 60.0, error), 0.06) << points << " points";
    EXPECT_EQ(run.odometry->faults()["time_offset_step"], 0u) << points << " points";
  }
}

/// Less than a bin of the Doppler, and too steady for the IMU to see.
SimulatedRun creeping(std::uint64_t seed, double speed, double points) {
  simulation::MotionRequest request;
  request.name = "constant_speed";
  request.seed = seed;
  request.duration = 45.0;
  request.speed = speed;
  request.rest.static_start = 5.0;
  request.rest.static_end = 0.0;
  SimulatedRun run("constant_speed", seed, 45.0, 5.0);
  run.motion = simulation::makeMotion(request);
  run.setup.radar.points_mean = points;
  return run;
}

TEST(Creeping, IsNoRest) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    SimulatedRun run = creeping(seed, 0.1, 60.0);
    run.run();
    int at_rest = 0;
    int all = 0;
    for (const ScanResult& result : run.results) {
      if (run.seconds(result.scan.stamp) < 8.0 || !result.used) continue;
      ++all;
      at_rest += result.ego_velocity.status == EgoVelocityStatus::kZeroVelocity ? 1 : 0;
    }
    const auto error = [&](const NavigationState& state) { return run.velocityError(state); };
    EXPECT_GT(all, 300);
    EXPECT_LT(at_rest, all / 10) << "seed " << seed;
    // The estimator needs the noise of the Doppler to find the speed within its bin. If it takes the noise
    // for twice as large, this error is 0.017 m/s.
    EXPECT_LT(run.rms(10.0, 45.0, error), 0.012) << "seed " << seed;
  }
}

// Most scans by themselves look like those of a platform at rest.
TEST(Creeping, IsNoRestEvenIfOneScanDoesNotTell) {
  for (const double points : {15.0, 60.0}) {
    for (const std::uint64_t seed : {1, 2, 3}) {
      SimulatedRun run = creeping(seed, 0.05, points);
      run.run();
      const auto error = [&](const NavigationState& state) { return run.velocityError(state); };
      EXPECT_LT(run.rms(15.0, 45.0, error), 0.03) << "points " << points << ", seed " << seed;
    }
  }
}

TEST(Rest, APlatformThatStandsStillDoesNotDrift) {
  SimulatedRun run("medium", 1, 60.0, 45.0);
  run.run([&](simulation::SensorData& data) {
    const auto moves = [&](const auto& item) { return run.seconds(item.stamp) > 44.0; };
    data.scans.erase(std::remove_if(data.scans.begin(), data.scans.end(), moves), data.scans.end());
  });
  ASSERT_FALSE(run.results.empty());
  const NavigationState& state = run.results.back().state;
  const auto sigma = state.covariance.diagonal().segment<3>(StateBlock::kP).cwiseSqrt();
  EXPECT_LT(sigma.maxCoeff(), 0.03);  // after 40 s
  EXPECT_LT((run.truth(state).p_W - state.p_W).norm(), 3.0 * sigma.norm());
}

/// A drone whose rotors idle, for one.
TEST(Rest, AnyPlatformMayRestOnAFrameThatShakes) {
  SimulatedRun run("medium", 2, 60.0, 45.0);
  run.setup.imu.accel_vibration = 0.8;
  run.run();
  int at_rest = 0;
  for (const ScanResult& result : run.results)
    if (run.seconds(result.scan.stamp) > 10.0 && run.seconds(result.scan.stamp) < 45.0)
      at_rest += result.at_rest ? 1 : 0;
  EXPECT_GT(at_rest, 300);
  // The published velocity is zero at rest, and follows the platform after it.
  const auto error = [&](const NavigationState& state) { return run.velocityError(state); };
  EXPECT_LT(run.rms(10.0, 45.0, error), 0.01);
  EXPECT_LT(run.rms(45.0, 60.0, error), 0.1);
}

/// With noisy directions a larger velocity would explain larger residuals.
TEST(Rest, ANoisierDopplerThanToldDoesNotRunAway) {
  for (const double step : {0.0, 0.125}) {
    SimulatedRun run("medium", 1, 60.0, 45.0);
    run.setup.radar.doppler_noise = 0.15;
    run.setup.radar.doppler_step = step;
    run.options.rest.enabled = false;
    run.run();
    const auto error = [&](const NavigationState& state) { return run.velocityError(state); };
    EXPECT_LT(run.rms(2.0, 45.0, error), 0.03) << step;
  }
}

/// For five seconds a person walks away at 0.2 m/s, with a quarter of the points. A prediction that chose the
/// points went along: the velocity was off by 0.3 m/s with a sigma of 0.03.
TEST(Person, DoesNotLeadThePrediction) {
  SimulatedRun run("medium", 108, 90.0);
  run.setup.time_offset.constant = -0.037;
  run.run();
  const auto error = [&](const NavigationState& state) { return run.velocityError(state); };
  EXPECT_LT(run.rms(14.5, 19.0, error), 0.1);
}

/// Walks in which a crowd is in view for 30 % of the time. In the last one it fills the view for two seconds.
TEST(Crowd, IsNoDivergenceAndNoStepOfTheOffset) {
  struct Walk {
    int crowd;
    std::uint64_t seed;
  };
  for (const Walk& walk : {Walk{3, 3}, Walk{3, 4}, Walk{5, 3}, Walk{5, 4}, Walk{8, 12}}) {
    SimulatedRun run("walk", walk.seed, 100.0, 5.0);
    run.setup.radar.moving_share = 0.3;
    run.setup.radar.crowd = walk.crowd;
    run.run();
    const std::string name = std::to_string(walk.crowd) + " persons, seed " + std::to_string(walk.seed);
    EXPECT_EQ(run.odometry->faults()["diverged"], 0u) << name;
    EXPECT_EQ(run.odometry->faults()["time_offset_step"], 0u) << name;
    const auto error = [&](const NavigationState& state) { return run.velocityError(state); };
    EXPECT_LT(run.rms(10.0, 100.0, error), 0.1) << name;
  }
}

}  // namespace
}  // namespace rio_t
