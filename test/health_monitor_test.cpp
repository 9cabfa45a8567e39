// Divergence is detected where radar and IMU contradict each other, never where they do not, and told.
#include "rio_t/odometry/health_monitor.h"

#include <gtest/gtest.h>

#include <limits>

#include "rio_t/core/so3.h"
#include "rio_t/factors/state_block.h"
#include "simulated_run.h"

namespace rio_t {
namespace {

Time at(double seconds) { return Time::fromSeconds(seconds); }

NavigationState knownState() {
  NavigationState state;
  state.covariance.diagonal().setConstant(1e-4);
  return state;
}

/// Off by `speed` [m/s] along x, with that variance.
Innovation innovation(Time stamp, double speed, double variance) {
  Innovation result;
  result.stamp = stamp;
  result.d = {speed, 0.0, 0.0};
  result.S = variance * Eigen::Matrix3d::Identity();
  return result;
}

/// Scans at 10 Hz with an innovation of `sigmas` along x; the health after the last.
Health feed(HealthMonitor& monitor, double from, double to, double sigmas, double model_error_scale = 1.0) {
  Health health = monitor.health();
  for (int k = 0; from + 0.1 * k < to; ++k) {
    const Time stamp = at(from + 0.1 * k);
    monitor.addInnovation(innovation(stamp, 0.1 * sigmas, 0.01));
    monitor.updated(stamp);
    health = monitor.judge(stamp, knownState(), model_error_scale);
  }
  return health;
}

TEST(HealthMonitor, ManyScansMustContradict) {
  HealthMonitor monitor(HealthOptions(), 4.0);
  EXPECT_EQ(feed(monitor, 0.0, 10.0, 2.0), Health::kOk);
  EXPECT_EQ(feed(monitor, 10.0, 12.0, 10.0), Health::kOk);  // half of the window
  EXPECT_EQ(feed(monitor, 12.0, 14.0, 10.0), Health::kDiverged);
  // And agree, to be trusted again.
  EXPECT_EQ(feed(monitor, 14.0, 16.0, 1.0), Health::kDiverged);
  EXPECT_EQ(feed(monitor, 16.0, 18.0, 1.0), Health::kOk);
}

TEST(HealthMonitor, TellsWithinFiveSecondsWhatContradictsInThreeScansOfFour) {
  HealthMonitor monitor(HealthOptions(), 4.0);
  feed(monitor, 0.0, 10.0, 1.0);
  for (double t = 10.0; t < 15.0; t += 0.4) {
    feed(monitor, t, t + 0.3, 10.0);
    feed(monitor, t + 0.3, t + 0.4, 0.0);
  }
  EXPECT_EQ(monitor.health(), Health::kDiverged);
}

/// The monitor keeps 1000 scans, here those of 100 s.
TEST(HealthMonitor, AWindowOfMoreScansThanItKeepsIsFull) {
  HealthOptions options;
  options.window = 200.0;
  HealthMonitor monitor(options, 4.0);
  EXPECT_EQ(feed(monitor, 0.0, 95.0, 10.0), Health::kOk);
  EXPECT_EQ(feed(monitor, 95.0, 105.0, 10.0), Health::kDiverged);
}

TEST(HealthMonitor, ScansThatDecideNothingContradictNothing) {
  // Half of the scans: a crowd that fills the view.
  HealthMonitor monitor(HealthOptions(), 4.0);
  for (int i = 0; i < 40; ++i) {
    if (i % 2 == 0) {
      monitor.addInnovation(innovation(at(5.0 + 0.1 * i), 2.0, 0.01));
    } else {
      monitor.addUndecided(at(5.0 + 0.1 * i));
    }
    monitor.updated(at(5.0 + 0.1 * i));
    EXPECT_EQ(monitor.judge(at(5.0 + 0.1 * i), knownState()), Health::kOk);
  }
}

TEST(HealthMonitor, FewScansProveNothing) {
  HealthMonitor monitor(HealthOptions(), 4.0);
  for (int k = 0; k < 5; ++k) {
    monitor.addInnovation(innovation(at(0.4 * k), 9.0, 1.0));
    monitor.updated(at(0.4 * k));
    EXPECT_EQ(monitor.judge(at(0.4 * k), knownState()), Health::kOk);
  }
}

TEST(HealthMonitor, ModelsThatDoNotFitAreADivergence) {
  HealthMonitor monitor(HealthOptions(), 4.0);
  feed(monitor, 0.0, 5.0, 1.0);
  EXPECT_EQ(monitor.judge(at(5.0), knownState(), 10.0), Health::kOk);
  // For a moment, it may be a few outliers; over a whole window, it is the models.
  const double window = HealthOptions().window;
  EXPECT_EQ(feed(monitor, 5.1, 5.1 + window - 0.05, 1.0, 30.0), Health::kOk);
  EXPECT_EQ(feed(monitor, 5.1 + window, 5.5 + window, 1.0, 30.0), Health::kDiverged);
  EXPECT_FALSE(monitor.wantsReinitialization(at(60.0))) << "a new start would fit no better";
  EXPECT_EQ(monitor.judge(at(5.6 + window), knownState(), 10.0), Health::kOk);
  EXPECT_EQ(monitor.judge(at(5.7 + window), knownState(), 30.0), Health::kOk) << "each has to last by itself";
}

TEST(HealthMonitor, AnOffsetThatStepsAllTheTimeIsADivergence) {
  HealthMonitor monitor(HealthOptions(), 4.0);
  EXPECT_EQ(feed(monitor, 0.0, 10.0, 1.0), Health::kOk);
  for (const double step : {10.0, 14.0}) {
    monitor.offsetStepped(at(step));
    EXPECT_EQ(feed(monitor, step, step + 4.0, 1.0), Health::kOk) << step;
  }
  monitor.offsetStepped(at(18.0));
  EXPECT_EQ(feed(monitor, 18.0, 18.5, 1.0), Health::kDiverged);
  EXPECT_EQ(feed(monitor, 18.5, 22.0, 1.0), Health::kOk);
  // Far apart, each is what it says.
  for (const double step : {40.0, 70.0, 100.0}) {
    monitor.offsetStepped(at(step));
    EXPECT_EQ(feed(monitor, step, step + 5.0, 1.0), Health::kOk) << step;
  }
}

TEST(HealthMonitor, StepsOfADivergenceAreNoneAfterIt) {
  HealthMonitor monitor(HealthOptions(), 4.0);
  feed(monitor, 0.0, 10.0, 1.0);
  EXPECT_EQ(feed(monitor, 10.0, 14.0, 100.0), Health::kDiverged);
  for (const double step : {14.0, 15.0, 16.0}) monitor.offsetStepped(at(step));
  EXPECT_EQ(feed(monitor, 16.0, 20.0, 1.0), Health::kOk);
  EXPECT_EQ(feed(monitor, 20.0, 22.0, 1.0), Health::kOk);
}

TEST(HealthMonitor, CoastsWithoutScansAndDivergesWhereNothingIsKnown) {
  HealthMonitor monitor(HealthOptions(), 4.0);
  feed(monitor, 0.0, 5.0, 1.0);
  EXPECT_EQ(monitor.judge(at(5.5), knownState()), Health::kOk);
  EXPECT_EQ(monitor.judge(at(6.5), knownState()), Health::kCoasting);
  NavigationState vague = knownState();
  vague.covariance(7, 7) = 1.1;
  EXPECT_EQ(monitor.judge(at(6.5), vague), Health::kDiverged);
  NavigationState broken = knownState();
  broken.v_W.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(monitor.judge(at(6.5), broken), Health::kDiverged);
  broken = knownState();
  broken.covariance(6, 6) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(monitor.judge(at(6.5), broken), Health::kDiverged);
  EXPECT_FALSE(monitor.wantsReinitialization(at(100.0)));  // no scan contradicts
}

TEST(HealthMonitor, AVagueVelocityContradictsNothing) {
  HealthMonitor monitor(HealthOptions(), 4.0);
  NavigationState vague = knownState();
  vague.covariance(7, 7) = 1.1;
  EXPECT_EQ(monitor.judge(at(0.0), vague), Health::kDiverged);
  EXPECT_FALSE(monitor.isContradicted());
  feed(monitor, 1.0, 5.0, 10.0);
  EXPECT_TRUE(monitor.isContradicted());
}

// With a vague velocity both radars are as bad, but only one of them contradicts the estimate.
TEST(RadarsHealth, IsThatOfTheRadarThatAgrees) {
  for (const std::size_t wrong : {0, 1}) {
    RadarsHealth health(HealthOptions(), 4.0, 2);
    NavigationState vague = knownState();
    vague.covariance(7, 7) = 1.1;
    for (double t = 0.0; t < 4.0; t += 0.1) {
      for (const std::size_t radar : {0, 1})
        health.of(radar).addInnovation(innovation(at(t), radar == wrong ? 1.0 : 0.1, 0.01));
      health.judge(at(t), vague, 1.0);
    }
    EXPECT_EQ(health.health(), Health::kDiverged);
    EXPECT_FALSE(health.isContradicted()) << "radar " << wrong << " is wrong";
  }
}

/// A step of the offset clears what one radar has said. It does not fall silent by that.
TEST(RadarsHealth, AStepOfTheOffsetDoesNotHandItToARadarThatIsWrong) {
  RadarsHealth health(HealthOptions(), 4.0, 2);
  for (double t = 0.0; t < 10.0; t += 0.1) {
    for (const std::size_t radar : {0, 1})
      health.of(radar).addInnovation(innovation(at(t), radar == 1 ? 1.0 : 0.1, 0.01));
    health.judge(at(t), knownState(), 1.0);
  }
  EXPECT_FALSE(health.isContradicted());
  health.of(0).offsetStepped(at(9.9));
  health.judge(at(9.9), knownState(), 1.0);
  EXPECT_FALSE(health.isContradicted());
}

// An IMU gap loses the heading for good, and with it v_W; the motion is known all the same.
TEST(HealthMonitor, ALostHeadingIsNoDivergence) {
  HealthMonitor monitor(HealthOptions(), 4.0);
  NavigationState state = knownState();
  state.q_WI = so3::exp({0.3, -0.2, 1.0});
  state.v_W = {3.0, 1.0, 0.5};
  monitor.updated(at(0.0));
  Eigen::Matrix<double, StateBlock::kTangent, 1> turn =
      Eigen::Matrix<double, StateBlock::kTangent, 1>::Zero();
  turn.segment<3>(StateBlock::kTheta) = state.q_WI.conjugate() * Eigen::Vector3d::UnitZ();
  turn.segment<3>(StateBlock::kV) = Eigen::Vector3d::UnitZ().cross(state.v_W);
  state.covariance += 0.7 * 0.7 * turn * turn.transpose();
  EXPECT_GT(std::sqrt(state.covariance(7, 7)), 2.0);
  EXPECT_EQ(monitor.judge(at(0.1), state), Health::kOk);
  state.covariance.diagonal().segment<3>(StateBlock::kV).array() += 1.0;
  EXPECT_EQ(monitor.judge(at(0.2), state), Health::kDiverged);
}

TEST(HealthMonitor, AStepOfTheOffsetExplainsOnce) {
  HealthMonitor monitor(HealthOptions(), 4.0);
  feed(monitor, 0.0, 5.0, 1.0);
  feed(monitor, 5.0, 7.4, 10.0);
  monitor.offsetStepped(at(7.4));
  EXPECT_EQ(feed(monitor, 7.4, 9.0, 10.0), Health::kOk);
  monitor.offsetStepped(at(9.0));
  EXPECT_EQ(feed(monitor, 9.0, 11.0, 10.0), Health::kDiverged);
}

TEST(HealthMonitor, ReinitialisesLateAndIsThenOnTrial) {
  HealthMonitor monitor(HealthOptions(), 4.0);
  feed(monitor, 0.0, 3.0, 10.0);  // diverged at 2.8 s
  ASSERT_EQ(monitor.health(), Health::kDiverged);
  EXPECT_FALSE(monitor.wantsReinitialization(at(7.0)));
  EXPECT_TRUE(monitor.wantsReinitialization(at(8.0)));
  monitor.startedAt(at(8.0));
  EXPECT_FALSE(monitor.wantsReinitialization(at(12.9)));
  EXPECT_EQ(feed(monitor, 8.0, 10.0, 1.0), Health::kDiverged);
  EXPECT_EQ(feed(monitor, 10.0, 11.0, 1.0), Health::kOk);
  HealthOptions report;
  report.on_divergence = OnDivergence::kReport;
  HealthMonitor reporter(report, 4.0);
  EXPECT_EQ(feed(reporter, 0.0, 20.0, 10.0), Health::kDiverged);
  EXPECT_FALSE(reporter.wantsReinitialization(at(20.0)));
}

TEST(HealthMonitor, TheCovarianceGrowsWithWhatContradicts) {
  HealthMonitor monitor(HealthOptions(), 4.0);
  NavigationState state = knownState();
  feed(monitor, 0.0, 1.0, 20.0);
  monitor.widen(state);
  EXPECT_EQ(state.covariance, knownState().covariance);
  feed(monitor, 1.0, 3.0, 20.0);
  monitor.widen(state);
  EXPECT_GT(std::sqrt(state.covariance(6, 6)), 2.0);  // the innovations are 2 m/s
  NavigationState later = knownState();
  feed(monitor, 3.0, 6.0, 20.0);
  monitor.widen(later);
  EXPECT_GT(later.covariance(3, 3), 2.0 * state.covariance(3, 3));
}

constexpr double kFault = 22.0;  // [s]

struct Diverged {
  double first = -1.0, last = -1.0;  ///< [s], stamps of scans
  int reinitialized = 0;
};
Diverged divergedIn(const SimulatedRun& run) {
  Diverged diverged;
  for (const ScanResult& result : run.results) {
    if (result.reinitialized) ++diverged.reinitialized;
    if (result.health != Health::kDiverged) continue;
    diverged.last = run.seconds(result.scan.stamp);
    if (diverged.first < 0.0) diverged.first = diverged.last;
  }
  return diverged;
}

TEST(Divergence, IsNeverRaisedOnHealthyData) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    for (const double offset : {-0.05, 0.0, 0.03, 0.1}) {
      for (const double step : {0.0, -0.05, 0.08}) {
        if (step != 0.0 && offset != 0.03) continue;
        SimulatedRun run("difficult", seed, 45.0);
        run.setup.time_offset.constant = offset;
        if (step != 0.0) run.setup.time_offset.steps.push_back({30.0, step});
        run.run();
        EXPECT_EQ(run.odometry->faults().count("diverged"), 0U)
            << "seed " << seed << ", offset " << offset << ", step " << step << ", at "
            << divergedIn(run).first << " s";
        EXPECT_EQ(run.odometry->health(), Health::kOk);
      }
    }
  }
}

TEST(Divergence, AnImuThatTurnsOnItsMountIsTold) {
  for (const OnDivergence policy : {OnDivergence::kReport, OnDivergence::kReinitialize}) {
    SimulatedRun run("difficult", 1, 40.0);
    run.options.health.on_divergence = policy;
    run.run([&](simulation::SensorData& data) {
      const Eigen::Quaterniond turn = so3::exp({0.5, 0.3, 0.4});
      for (ImuMeasurement& sample : data.imu.samples) {
        if (run.seconds(sample.time) < kFault) continue;
        sample.angular_velocity = turn * sample.angular_velocity;
        sample.acceleration = turn * sample.acceleration;
      }
    });
    const Diverged diverged = divergedIn(run);
    EXPECT_GT(diverged.first, kFault);
    EXPECT_LT(diverged.first, kFault + 4.0);
    EXPECT_GE(run.odometry->faults().at("diverged"), 1U);
  }
}

TEST(Divergence, ADopplerThatChangesItsSignIsToldAndBridged) {
  SimulatedRun run("difficult", 2, 40.0);
  run.run([&](simulation::SensorData& data) {
    for (simulation::SimulatedScan& scan : data.scans) {
      const double t = run.seconds(scan.stamp);
      if (t < kFault || t > kFault + 4.0) continue;
      for (simulation::SimulatedPoint& point : scan.points) point.doppler = -point.doppler;
    }
  });
  const Diverged diverged = divergedIn(run);
  EXPECT_GT(diverged.first, kFault);
  const double window = run.options.health.window;
  EXPECT_LT(diverged.first, kFault + window);
  EXPECT_LT(diverged.last, kFault + 4.0 + window);
  // Shorter than reinitialize_after: the IMU carried it, and nothing was believed to the radar.
  EXPECT_EQ(diverged.reinitialized, 0);
  EXPECT_LT(run.rms(kFault + 1.0, kFault + 4.0, [&](const auto& s) { return run.velocityError(s); }), 0.3);
  EXPECT_LT(run.rms(kFault + 6.0, 40.0, [&](const auto& s) { return run.velocityError(s); }), 0.05);
}

TEST(Divergence, AnAccelerometerBiasThatJumpsIsToldAndOvercome) {
  for (const std::uint64_t seed : {1U, 2U}) {
    SimulatedRun run("difficult", seed, 50.0);
    run.run([&](simulation::SensorData& data) {
      for (ImuMeasurement& sample : data.imu.samples)
        if (run.seconds(sample.time) >= kFault) sample.acceleration.x() += 1.0;
    });
    const Diverged diverged = divergedIn(run);
    EXPECT_GT(diverged.first, kFault);
    EXPECT_LT(diverged.first, kFault + 3.0);
    EXPECT_GE(diverged.reinitialized, 1);
    EXPECT_EQ(run.odometry->faults().at("reinitialized"), static_cast<std::uint64_t>(diverged.reinitialized));
    EXPECT_EQ(run.odometry->health(), Health::kOk);
    EXPECT_LT(run.rms(45.0, 50.0, [&](const auto& s) { return run.velocityError(s); }), 0.1);
    // While diverged the covariance covers the error, and where the estimate is re-initialised the position
    // and the heading go on.
    for (std::size_t k = 1; k < run.states.size(); ++k) {
      const NavigationState& state = run.states[k];
      const double t = run.seconds(state.time);
      ASSERT_TRUE(state.covariance.allFinite());
      if (t > diverged.first + 0.3 && t < diverged.last) {
        const double sigma = std::sqrt(state.covariance.diagonal().segment<3>(6).sum());
        EXPECT_LT(run.velocityError(state), 4.0 * sigma) << "at " << t << " s";
      }
      const NavigationState& before = run.states[k - 1];
      EXPECT_LT((state.p_W - before.p_W).norm(), 5.0) << "at " << t << " s";
      const double turn_z = so3::log(state.q_WI * before.q_WI.conjugate()).z();
      EXPECT_LT(std::abs(turn_z), 0.05) << "at " << t << " s";
    }
  }
}

// Nothing brings back the metres that a wrong velocity drove before the scans mended it.
TEST(Divergence, TheSigmaOfThePositionOutlivesIt) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    SimulatedRun run("medium", seed, 70.0);
    run.options.health.on_divergence = OnDivergence::kReport;
    run.run([&](simulation::SensorData& data) {
      for (ImuMeasurement& sample : data.imu.samples)
        if (run.seconds(sample.time) > 35.0 && run.seconds(sample.time) < 38.0)
          sample.acceleration.x() += 1.0;
    });
    EXPECT_GE(run.odometry->faults()["diverged"], 1U) << seed;
    const NavigationState& end = run.states.back();
    EXPECT_EQ(run.odometry->health(), Health::kOk) << seed;
    const double sigma = std::sqrt(end.covariance.block<3, 3>(StateBlock::kP, StateBlock::kP).trace());
    EXPECT_LT(run.positionError(end), 2.0 * sigma) << seed;
  }
}

TEST(Divergence, ABlackoutIsCoastingAndNotDivergence) {
  SimulatedRun run("difficult", 3, 40.0);
  run.setup.radar.blackouts.push_back({kFault, 5.0});
  run.run();
  EXPECT_EQ(run.odometry->faults().count("diverged"), 0U);
  for (const ScanResult& result : run.results)
    EXPECT_EQ(result.health, Health::kOk) << "at " << run.seconds(result.scan.stamp);
  EXPECT_EQ(run.odometry->health(), Health::kOk);
}

TEST(Divergence, CoastingIsToldBetweenScans) {
  SimulatedRun run("difficult", 3, 30.0);
  run.setup.radar.blackouts.push_back({kFault, 100.0});
  run.run();
  EXPECT_EQ(run.odometry->health(), Health::kCoasting);
}

/// Error after `settled` seconds, for a start in motion and at rest alike.
TEST(StartInMotion, IsSoonAsGoodAsAStartAtRest) {
  for (const char* name : {"difficult", "drone"}) {
    for (const double offset : {-0.00925, 0.1}) {
      SimulatedRun moving(name, 4, 40.0, 0.0);
      moving.setup.time_offset.constant = offset;
      moving.run();
      ASSERT_TRUE(moving.odometry->start());
      EXPECT_EQ(moving.odometry->start()->from, InitializedFrom::kMotion);
      SimulatedRun resting(name, 4, 52.0, 12.0);
      resting.setup.time_offset.constant = offset;
      resting.run();
      EXPECT_EQ(resting.odometry->start()->from, InitializedFrom::kRest);
      const auto velocity = [](const SimulatedRun& run, double from) {
        return run.rms(from, 60.0, [&](const auto& s) { return run.velocityError(s); });
      };
      const auto tilt = [](const SimulatedRun& run, double from) {
        return run.rms(from, 60.0, [&](const auto& s) { return run.tiltError(s); });
      };
      EXPECT_LT(velocity(moving, 15.0), 1.5 * velocity(resting, 24.0) + 0.005) << name << " " << offset;
      EXPECT_LT(tilt(moving, 15.0), tilt(resting, 24.0) + 0.003) << name << " " << offset;
      EXPECT_NEAR(moving.results.back().time_offset, offset, 0.003) << name << " " << offset;
    }
  }
}

}  // namespace
}  // namespace rio_t
