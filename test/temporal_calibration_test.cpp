// The time offset over whole simulated runs: found in one pass from far away, followed when it drifts, found
// again after a step, and left alone where the motion does not show it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

#include "batch_of.h"
#include "simulated_run.h"

namespace rio_t {
namespace {

constexpr double kStart = 5.0;                   // [s] of rest
constexpr double kFullSpeed = kStart + 2.0;      // [s] after the ramp
constexpr double kFarAlong = kFullSpeed + 10.0;  // [s] after ten seconds of motion

struct OffsetAt {
  double error = 0.0;  ///< [s] estimate minus truth
  double sigma = 0.0;  ///< [s]
  double value = 0.0;  ///< [s]
};

OffsetAt offsetAt(const SimulatedRun& run, const ScanResult& result) {
  const double truth = run.setup.time_offset.at(run.seconds(result.scan.stamp));
  return {result.time_offset - truth, result.time_offset_sigma, result.time_offset};
}

/// The answer of the last scan before `time` [s].
OffsetAt offsetAt(const SimulatedRun& run, double time) {
  OffsetAt offset;
  for (const ScanResult& result : run.results) {
    if (result.updated && run.seconds(result.scan.stamp) <= time) offset = offsetAt(run, result);
  }
  return offset;
}

struct Consistency {
  double largest_error = 0.0;          ///< [s]
  double mean_square_in_sigmas = 0.0;  ///< of (error / sigma)
  double share_within_interval = 0.0;  ///< of scans whose 95 % interval holds the truth
};
/// It counts the scans from `from` on.
Consistency consistency(const SimulatedRun& run, double from) {
  Consistency c;
  int count = 0;
  for (const ScanResult& result : run.results) {
    if (!result.updated || run.seconds(result.scan.stamp) < from) continue;
    const OffsetAt offset = offsetAt(run, result);
    const double in_sigmas = std::abs(offset.error) / offset.sigma;
    c.largest_error = std::max(c.largest_error, std::abs(offset.error));
    c.mean_square_in_sigmas += in_sigmas * in_sigmas;
    c.share_within_interval += in_sigmas < 1.96 ? 1.0 : 0.0;
    ++count;
  }
  c.mean_square_in_sigmas /= count;
  c.share_within_interval /= count;
  return c;
}

TEST(TemporalCalibration, TheSigmaIsNeitherTooSmallNorTooLarge) {
  double mean_square = 0.0;
  double within = 0.0;
  constexpr int kSeeds = 6;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SimulatedRun run(seed % 2 == 0 ? "difficult" : "medium", seed, 60.0, kStart);
    run.setup.time_offset.constant = 0.03;
    run.run();
    const Consistency c = consistency(run, 20.0);
    mean_square += c.mean_square_in_sigmas / kSeeds;
    within += c.share_within_interval / kSeeds;
  }
  EXPECT_GT(within, 0.85);
  // The options' noise alone makes this 0.12.
  EXPECT_GT(mean_square, 0.15);
  EXPECT_LT(mean_square, 1.5);
}

TEST(TemporalCalibration, ATruthBeyondTheBoundIsTold) {
  SimulatedRun run("medium", 1, 30.0, kStart);
  run.setup.time_offset.constant = 0.08;
  run.options.smoother.max_time_offset = 0.05;
  run.run();
  int at_bound = 0, windows = 0;
  for (const ScanResult& result : run.results) {
    if (!result.updated || run.seconds(result.scan.stamp) < kFarAlong) continue;
    ++windows;
    if (result.solver_termination != SolverTermination::kAtBound) continue;
    ++at_bound;
    EXPECT_LT(std::abs(result.time_offset - 0.08), result.time_offset_sigma);
  }
  EXPECT_GT(windows, 100);
  EXPECT_GT(at_bound, 0.9 * windows);
}

// The noise moves the estimate off its bound now and then. The curvature there knows nothing of the truth.
TEST(TemporalCalibration, JustInsideTheBoundItIsNoSurer) {
  SimulatedRun run("gym_loop", 3, 40.0, kStart);
  run.setup.time_offset.constant = 0.055;
  run.options.smoother.max_time_offset = 0.05;
  run.run();
  int inside = 0;
  for (const ScanResult& result : run.results) {
    if (!result.updated || run.seconds(result.scan.stamp) < kFarAlong) continue;
    if (std::abs(result.time_offset) < 0.05) ++inside;
    EXPECT_LT(std::abs(result.time_offset - 0.055), 2.0 * result.time_offset_sigma);
  }
  EXPECT_GT(inside, 20);
}

TEST(TemporalCalibration, FarOffsetsAreFoundInOnePass) {
  double sum = 0.0, position = 0.0;
  int count = 0;
  for (const double truth : {-0.05, 0.1, 0.2}) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      SimulatedRun run("difficult", seed, 40.0, kStart);
      run.setup.time_offset.constant = truth;
      run.run();
      const OffsetAt early = offsetAt(run, kFarAlong);
      EXPECT_LT(std::abs(early.error), 2.0 * early.sigma) << truth << " s, seed " << seed;
      EXPECT_LT(early.sigma, 2.0e-3);
      sum += std::abs(early.error);
      ++count;
      const OffsetAt end = offsetAt(run, 40.0);
      EXPECT_LT(std::abs(end.error), 0.5e-3) << truth << " s, seed " << seed;
      std::size_t rejected = 0;
      for (const ScanResult& result : run.results) rejected += result.rejected_because == "innovation";
      EXPECT_LE(rejected, 4u) << "good scans, while the offset was wrong";
      position += run.rms(0.0, 40.0, [&](const auto& state) { return run.wayError(state).norm(); });
    }
  }
  EXPECT_LT(sum / count, 0.5e-3) << "mean size of the error after ten seconds of motion";
  // The README says 0.06 m. Here it is 0.054 m; other draws of the noise may give half as much again.
  EXPECT_LT(position / count, 0.08);
}

TEST(TemporalCalibration, ASlowDriftIsFollowed) {
  // 20 ms in ten minutes. What does not follow is 3 ms off at the end.
  const double drift = 0.02 / 600.0;
  for (const double noise : {1.0e-4, 2.0e-4}) {
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
      SimulatedRun run("difficult", seed, 95.0, kStart);
      run.setup.time_offset.constant = 0.01;
      run.setup.time_offset.drift = drift;
      run.options.smoother.time_offset_noise = noise;
      run.run();
      const Consistency c = consistency(run, 20.0);
      EXPECT_LT(c.largest_error, 1.6e-3) << "seed " << seed << ", noise " << noise;
      // A random walk lags behind a drift, and the sigma owns up to that.
      EXPECT_LT(c.mean_square_in_sigmas, 4.0) << "seed " << seed << ", noise " << noise;
      const OffsetAt end = offsetAt(run, 95.0);
      EXPECT_NEAR(end.value - offsetAt(run, 35.0).value, 60.0 * drift, 0.5 * 60.0 * drift);
    }
  }
}

TEST(TemporalCalibration, AStepIsFoundAgain) {
  for (const double step : {0.05, -0.05}) {
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
      SimulatedRun run("difficult", seed, 55.0, kStart);
      run.setup.time_offset.constant = step > 0.0 ? -0.00925 : 0.05;
      run.setup.time_offset.steps = {{35.0, step}};
      run.run();
      EXPECT_EQ(run.odometry->faults()["time_offset_step"], 1u);
      const OffsetAt before = offsetAt(run, 34.9);
      EXPECT_LT(std::abs(before.error), 1.5e-3);
      const OffsetAt after = offsetAt(run, 55.0);  // 20 s later
      EXPECT_LT(std::abs(after.error), 1.5e-3) << "step " << step << ", seed " << seed;
      EXPECT_LT(std::abs(after.error), 2.0 * after.sigma);
    }
  }
}

TEST(TemporalCalibration, CoastingTeachesNothing) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    SimulatedRun run("constant_speed", seed, 60.0, kStart);
    run.setup.time_offset.constant = 0.02;
    run.run();
    const OffsetAt begin = offsetAt(run, 10.0);
    const OffsetAt end = offsetAt(run, 60.0);
    // The ramp tells something, the ride does not.
    EXPECT_LT(begin.sigma, 0.5 * run.options.radar.time_offset_sigma);
    EXPECT_GT(end.sigma, 0.98 * begin.sigma);
    // It tells tilt and bias apart, on which the offset depended: no more than that.
    const double learnt = std::sqrt(begin.sigma * begin.sigma - end.sigma * end.sigma);
    EXPECT_LT(std::abs(end.value - begin.value), 3.0 * learnt);
    EXPECT_LT(std::abs(end.error), 2.0 * end.sigma);
  }
}

/// The straight line at constant speed on a frame that vibrates with `vibration` [m/s^2] around `frequency`
/// [Hz], 0 for white.
SimulatedRun shakenLine(double imu_rate, double vibration, double frequency, std::uint64_t seed) {
  SimulatedRun run("constant_speed", seed, 60.0, kStart);
  run.setup.imu.rate = imu_rate;
  run.setup.imu.accel_vibration = vibration;
  run.setup.imu.vibration_frequency = frequency;
  run.setup.time_offset.constant = 0.03;
  run.run();
  return run;
}

TEST(TemporalCalibration, VibrationTeachesNothing) {
  struct Shaken {
    double imu_rate, vibration, frequency;
  };
  for (const std::uint64_t seed : {1, 2}) {
    for (const double imu_rate : {100.0, 400.0}) {
      const double quiet_sigma = offsetAt(shakenLine(imu_rate, 0.0, 0.0, seed), 60.0).sigma;
      for (const Shaken& shaken :
           {Shaken{imu_rate, 0.3, 0.0}, Shaken{imu_rate, 0.8, 0.0}, Shaken{imu_rate, 2.0, 0.0},
            Shaken{imu_rate, 0.8, 37.0}, Shaken{imu_rate, 0.8, 15.0}}) {
        const SimulatedRun run = shakenLine(shaken.imu_rate, shaken.vibration, shaken.frequency, seed);
        for (const ScanResult& result : run.results) {
          if (!result.updated || run.seconds(result.scan.stamp) < 20.0) continue;
          const OffsetAt offset = offsetAt(run, result);
          ASSERT_LT(std::abs(offset.error), 3.0 * offset.sigma)
              << imu_rate << " Hz, " << shaken.vibration << " m/s^2, " << shaken.frequency << " Hz, seed "
              << seed << " at " << run.seconds(result.scan.stamp) << " s";
        }
        if (shaken.frequency == 0.0) {
          EXPECT_GT(offsetAt(run, 60.0).sigma, 0.5 * quiet_sigma);
        }
      }
    }
  }
}

// The estimated velocity and the derivative hold the same noise.
TEST(TemporalCalibration, VibrationIsNoStep) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SimulatedRun run("walk", seed, 100.0, kStart);
    run.setup.radar.rate = 25.0;
    run.setup.imu.rate = 100.0;
    run.setup.imu.accel_vibration = 2.0;
    run.setup.time_offset.constant = 0.03;
    run.run();
    EXPECT_EQ(run.odometry->faults()["time_offset_step"], 0U) << seed;
    EXPECT_EQ(run.odometry->faults()["diverged"], 0U) << seed;
  }
}

TEST(TemporalCalibration, AStepIsFoundAtAnyRate) {
  for (const double rate : {5.0, 25.0, 50.0}) {
    SimulatedRun run("difficult", 2, 45.0, kStart);
    run.setup.radar.rate = rate;
    run.setup.time_offset.steps = {{35.0, 0.1}};
    run.run();
    EXPECT_LE(run.odometry->faults()["time_offset_step"], 2u) << rate << " Hz";
    // At 5 Hz a step is found after two seconds, and two seconds of contradiction are told.
    if (rate > 5.0) {
      EXPECT_EQ(run.odometry->faults()["diverged"], 0u) << rate << " Hz";
    }
    // At 5 Hz it takes twice as long to see as many scans as at 10.
    EXPECT_LT(std::abs(offsetAt(run, rate < 10.0 ? 41.0 : 38.0).error), 5.0e-3) << rate << " Hz";
    EXPECT_LT(std::abs(offsetAt(run, 45.0).error), 2.0e-3) << rate << " Hz";
  }
}

// With a smaller offset a scan is read later, where the IMU does not reach yet.
TEST(TemporalCalibration, AStepDoesNotLookAhead) {
  SimulatedRun run("medium", 2, 40.0, kStart);
  run.setup.radar.rate = 25.0;
  run.setup.time_offset.constant = 0.1;
  run.setup.time_offset.steps = {{35.0, -0.2}};
  run.run();
  EXPECT_EQ(run.odometry->faults()["time_offset_step"], 1u);
  EXPECT_LT(std::abs(offsetAt(run, 40.0).error), 5.0e-3);
  for (std::size_t k = 1; k < run.states.size(); ++k) ASSERT_LT(run.states[k - 1].time, run.states[k].time);
}

/// Wild motion whose offset steps by 0.1 s at 45 s, of a run of 50 s.
SimulatedRun stepOfAShakenRun(std::uint64_t seed, double imu_rate, double vibration) {
  SimulatedRun run("difficult", seed, 50.0, kStart);
  run.setup.radar.rate = 25.0;
  run.setup.imu.rate = imu_rate;
  run.setup.imu.accel_vibration = vibration;
  run.setup.time_offset.constant = 0.02;
  run.setup.time_offset.steps = {{45.0, 0.1}};
  run.run();
  EXPECT_LE(run.odometry->faults()["time_offset_step"], 2u) << seed;
  EXPECT_EQ(run.odometry->faults()["diverged"], 0u) << seed;
  return run;
}

// The scans from before the step must not hide it, nor may the noise pass for what they contradict. Three
// seconds after the step the sigma of the offset is up to 12 ms.
TEST(TemporalCalibration, AStepIsFoundUnderVibration) {
  constexpr std::uint64_t kRuns = 10;
  double squares = 0.0;
  for (std::uint64_t seed = 3; seed < 3 + kRuns; ++seed) {
    const double error = offsetAt(stepOfAShakenRun(seed, 200.0, 0.3), 48.0).error;
    squares += error * error;
  }
  EXPECT_LT(std::sqrt(squares / kRuns), 5.0e-3);
}

TEST(TemporalCalibration, AStepIsFoundSoonUnderStrongVibration) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed)
    EXPECT_LT(std::abs(offsetAt(stepOfAShakenRun(seed, 100.0, 0.8), 48.0).error), 0.03) << seed;
}

// The velocity follows the wrong offset, and the innovations hardly show the step.
TEST(TemporalCalibration, AStepInSlowMotionIsFound) {
  for (const std::uint64_t seed : {41, 44}) {
    SimulatedRun run("drone", seed, 65.0, kStart);
    run.setup.radar.rate = 30.0;
    run.setup.imu.rate = 200.0;
    run.setup.time_offset.constant = 0.02;
    run.setup.time_offset.steps = {{45.0, -0.03}};
    run.run();
    EXPECT_EQ(run.odometry->faults()["time_offset_step"], 1u) << seed;
    const OffsetAt found = offsetAt(run, 60.0);
    EXPECT_LT(std::abs(found.error), 0.01) << seed << ": a third of the step";
    EXPECT_LT(std::abs(found.error), 3.0 * found.sigma) << seed;
  }
}

// Until a step is found, the scans pull velocity and biases away, and these would pull the new offset.
TEST(TemporalCalibration, WhatAStepHasPulledDoesNotPullTheNewOffset) {
  double squares = 0.0, in_sigmas = 0.0;
  constexpr int kRuns = 6;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    SimulatedRun run("medium", seed, 44.0, kStart);
    run.setup.radar.rate = 25.0;
    run.setup.time_offset.constant = 0.03;
    run.setup.time_offset.steps = {{40.0, 0.1}};
    run.run();
    EXPECT_EQ(run.odometry->faults()["time_offset_step"], 1u) << seed;
    const OffsetAt found = offsetAt(run, 42.0);
    squares += found.error * found.error / kRuns;
    in_sigmas += std::pow(found.error / found.sigma, 2) / kRuns;
  }
  EXPECT_LT(std::sqrt(squares), 8.0e-3);
  EXPECT_LT(in_sigmas, 3.0);
}

TEST(TemporalCalibration, TheBatchKnowsWhenTheOffsetStepped) {
  SimulatedRun run("difficult", 1, 30.0, kStart);
  run.setup.time_offset.constant = 0.03;
  run.setup.time_offset.steps = {{25.0, 0.1}};
  run.run();
  run.results = batchOf(run).scans;
  EXPECT_NEAR(offsetAt(run, 24.8).error, 0.0, 2.0e-3);
  EXPECT_NEAR(offsetAt(run, 25.2).error, 0.0, 2.0e-3) << "a second before the online run found the step";
}

TEST(TemporalCalibration, TheBatchSaysTheSameOfTheOffset) {
  SimulatedRun run("difficult", 1, 40.0, kStart);
  run.setup.time_offset.constant = 0.1;
  run.run();
  const BatchResult whole = batchOf(run);
  EXPECT_TRUE(whole.solution.converged());
  ASSERT_EQ(whole.scans.size(), run.results.size());

  const OffsetAt online = offsetAt(run, 40.0);
  run.results = whole.scans;
  const OffsetAt end = offsetAt(run, 40.0);
  EXPECT_NEAR(end.value, online.value, 0.3 * online.sigma);
  EXPECT_NEAR(end.sigma / online.sigma, 1.0, 0.1);
  // What came later tells of the beginning, too.
  const OffsetAt begin = offsetAt(run, kFullSpeed);
  EXPECT_LT(std::abs(begin.error), 3.0 * begin.sigma);
  EXPECT_LT(begin.sigma, 2.0e-3);

  // The states between the nodes: one for each sample, without jumps.
  ASSERT_GE(whole.trajectory.size(), run.states.size());
  for (std::size_t i = 1; i < whole.trajectory.size(); ++i) {
    const NavigationState& a = whole.trajectory[i - 1];
    const NavigationState& b = whole.trajectory[i];
    ASSERT_LT(a.time, b.time);
    const Eigen::Vector3d expected = a.p_W + 0.5 * (b.time - a.time) * (a.v_W + b.v_W);
    ASSERT_LT((b.p_W - expected).norm(), 1.0e-3) << run.seconds(b.time) << " s";
  }
  const auto size = [&](const NavigationState& state) { return run.velocityError(state); };
  const double online_rms = run.rms(kFullSpeed, 40.0, size);
  run.states = whole.trajectory;
  EXPECT_LT(run.rms(kFullSpeed, 40.0, size), online_rms);
}

}  // namespace
}  // namespace rio_t
