// The barometer: its factor, its channel, and what it does for the height in the whole pipeline.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "batch_of.h"
#include "numeric_jacobian.h"
#include "rio_t/factors/barometer_factor.h"
#include "rio_t/sensors/barometer_channel.h"
#include "simulated_run.h"
#include "synthetic_motion.h"

namespace rio_t {
namespace {

Time at(double seconds) { return Time::fromSeconds(1000.0 + seconds); }

TEST(BarometerFactor, JacobiansAreCorrectAndTheTruthHasNoResidual) {
  const StateBlock x = SyntheticMotion().state(1.3);
  const std::vector<double> motion = motionOf(x);
  const double height = x.p_W().z() + 0.05 * x.v_W().z() + 2.0;
  expectJacobiansCorrect(BarometerFactor(height, 0.05, 0.3), {motion, {1.5}});
  const double bias = 2.0;
  const double* const blocks[2] = {motion.data(), &bias};
  double residual = 1.0;
  ASSERT_TRUE(BarometerFactor(height, 0.05, 0.3).Evaluate(blocks, &residual, nullptr));
  EXPECT_NEAR(residual, 0.0, 1e-12);
}

TEST(Barometer, HeightsAreThoseOfTheStandardAtmosphere) {
  // ISO 2533, table 5.
  EXPECT_NEAR(heightOfPressure(89874.6, 101325.0, 15.0), 1000.0, 0.1);
  EXPECT_NEAR(heightOfPressure(79495.2, 101325.0, 15.0), 2000.0, 0.1);
  EXPECT_NEAR(heightOfPressure(101325.0, 89874.6, 15.0 - 6.5), -1000.0, 0.1);
  EXPECT_EQ(heightOfPressure(95000.0, 95000.0, 20.0), 0.0);
}

TEST(Barometer, WhatIsNoPressureInPascalIsToldAndNotTaken) {
  EXPECT_EQ(faultOf(101325.0), "");
  EXPECT_NE(faultOf(1013.25).find("hPa"), std::string::npos);
  for (const double none : {0.0, -5.0, 1e6, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_NE(faultOf(none), "") << none;
    BarometerChannel channel{BarometerOptions()};
    EXPECT_STREQ(channel.add({at(0.0), none}, at(0.0)), "pressure_not_usable");
  }
}

TEST(Barometer, SamplesOutOfOrderOrAheadOfTheImuAreNotTaken) {
  BarometerChannel channel{BarometerOptions()};
  EXPECT_EQ(channel.add({at(1.0), 101325.0}, at(1.0)), nullptr);
  EXPECT_STREQ(channel.add({at(1.0), 101325.0}, at(1.1)), "pressure_out_of_order");
  EXPECT_STREQ(channel.add({at(0.5), 101325.0}, at(1.1)), "pressure_out_of_order");
  EXPECT_STREQ(channel.add({at(100.0), 101325.0}, at(1.1)), "pressure_ahead_of_imu");
  EXPECT_EQ(channel.add({at(1.2), 101325.0}, at(1.2)), nullptr);  // that one did not count
}

struct DroneRun : SimulatedRun {
  DroneRun(std::uint64_t seed, double duration, bool barometer) : SimulatedRun("drone", seed, duration, 5.0) {
    setup.barometer.enabled = true;
    setup.barometer.drift = 0.0;
    options.use_barometer = barometer;
  }
  /// Heights count from the start.
  double heightError(const NavigationState& state) const {
    return state.p_W.z() - (truth(state).p_W.z() - motion.at(0.0).p_W.z());
  }
  double heightRms(double from, double to) const {
    return rms(from, to, [this](const NavigationState& state) { return heightError(state); });
  }
  /// The answers to the means of pressures from `from` to `to` seconds.
  template <typename Predicate>
  int count(double from, double to, Predicate&& predicate) const {
    int count = 0;
    for (const ScanResult& result : results)
      for (const BarometerAnswer& mean : result.barometer)
        count += seconds(mean.time) >= from && seconds(mean.time) <= to && predicate(mean) ? 1 : 0;
    return count;
  }
};

bool isUsed(const BarometerAnswer& mean) { return mean.rejected_because.empty(); }
bool isShock(const BarometerAnswer& mean) { return mean.rejected_because == "innovation"; }
bool isMoving(const BarometerAnswer& mean) { return mean.rejected_because == "pressure_moves"; }
bool isStep(const BarometerAnswer& mean) { return mean.stepped; }

TEST(Barometer, HoldsTheHeightOfADrone) {
  DroneRun without(3, 120.0, false), with(3, 120.0, true);
  without.run();
  with.run();
  EXPECT_GT(with.count(6.0, 119.0, isUsed), 1000);  // ten means a second
  EXPECT_EQ(with.count(0.0, 120.0, isShock), 0);
  EXPECT_LT(with.heightRms(60.0, 120.0), 0.15);
  EXPECT_LT(with.heightRms(60.0, 120.0), without.heightRms(60.0, 120.0));
}

TEST(Barometer, TheBatchHoldsTheHeightThroughAStepOfThePressure) {
  const auto heightRms = [](bool barometer, double step) {
    DroneRun run(3, 90.0, barometer);
    run.setup.barometer.shocks = {{50.0, 1e3, step}};
    run.run();
    const BatchResult batch = batchOf(run);
    EXPECT_TRUE(batch.solution.converged());
    EXPECT_EQ(batch.solution.barometer_bias.has_value(), barometer);
    run.states = batch.trajectory;
    return run.heightRms(6.0, 90.0);
  };
  const double with = heightRms(true, 0.0);
  EXPECT_LT(with, 0.1);
  EXPECT_LT(with, heightRms(false, 0.0));
  EXPECT_LT(heightRms(true, 100.0), with + 0.1) << "8 m by the pressure";
}

TEST(Barometer, ShocksOfThePressureDoNoHarm) {
  DroneRun calm(4, 90.0, true), shocked(4, 90.0, true);
  // A door, a gust, and a pressure that stays.
  shocked.setup.barometer.shocks = {{25.0, 0.4, 100.0}, {45.0, 5.0, -100.0}, {65.0, 1e3, 100.0}};
  calm.run();
  shocked.run();
  EXPECT_GE(shocked.count(25.0, 26.0, isShock), 3);
  EXPECT_EQ(shocked.count(24.0, 27.0, isStep), 0);
  EXPECT_EQ(shocked.count(44.0, 64.0, isStep), 0);  // it came and went: the bias is the old one
  EXPECT_EQ(shocked.count(64.0, 90.0, isStep), 1);
  EXPECT_LT(shocked.heightRms(20.0, 90.0), calm.heightRms(20.0, 90.0) + 0.2);
  EXPECT_LT(std::abs(shocked.heightError(shocked.states.back())),
            std::abs(calm.heightError(calm.states.back())) + 0.2);
}

/// How much a disturbance of the pressure harms the estimate of a drone.
struct Disturbed {
  double harm = 0.0;  ///< [m] the height differs by at most this from that without the disturbance
  int steps = 0;
};

/// Adds `disturbance` [Pa], a function of the time [s], to the pressures of a flight.
Disturbed disturbed(const std::function<double(double)>& disturbance) {
  DroneRun calm(4, 90.0, true), run(4, 90.0, true);
  calm.run();
  run.run([&](simulation::SensorData& data) {
    for (simulation::SimulatedPressure& pressure : data.pressures)
      pressure.pascal += disturbance(run.seconds(pressure.stamp));
  });
  EXPECT_EQ(calm.count(0.0, 90.0, isMoving), 0);
  Disturbed result;
  for (std::size_t k = 0; k < std::min(calm.states.size(), run.states.size()); ++k)
    result.harm = std::max(result.harm, std::abs(run.states[k].p_W.z() - calm.states[k].p_W.z()));
  result.steps = run.count(0.0, 90.0, isStep);
  return result;
}

/// Thrice a hectopascal, at 30, 50 and 70 s.
double thrice(const std::function<double(double)>& shape, double t) {
  return 100.0 * (shape(t - 30.0) + shape(t - 50.0) + shape(t - 70.0));
}

/// The gate passes each mean of a slope. The slope against the motion tells.
TEST(Barometer, ASlopeOfThePressureDoesLittleHarm) {
  const Disturbed ramp = disturbed([](double t) { return 100.0 * std::clamp((t - 25.0) / 30.0, 0.0, 1.0); });
  EXPECT_LT(ramp.harm, 0.3);
  EXPECT_EQ(ramp.steps, 1);  // at its end
}

/// A pressure is not trusted before it rests, and then it is back.
TEST(Barometer, APressureThatComesBackSlowlyDoesNoHarm) {
  const Disturbed door = disturbed(
      [](double t) { return thrice([](double s) { return s < 0.0 ? 0.0 : std::exp(-s / 3.0); }, t); });
  EXPECT_LT(door.harm, 0.2);
  EXPECT_EQ(door.steps, 0);
  const Disturbed bell =
      disturbed([](double t) { return thrice([](double s) { return std::exp(-0.125 * s * s); }, t); });
  EXPECT_LT(bell.harm, 0.16);  // 0.19 if only the line through all of the memory is looked at
  EXPECT_EQ(bell.steps, 0);
}

TEST(Barometer, TheSigmaOfTheHeightIsWhatItsErrorsAre) {
  double nees = 0.0, count = 0.0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    DroneRun run(seed, 60.0, true);
    run.setup.barometer.drift = 0.06;  // Pa, 5 mm: that of the options
    run.run();
    for (const ScanResult& result : run.results) {
      if (!result.updated || run.seconds(result.state.time) < 10.0) continue;
      const double error = run.heightError(result.state);
      nees += error * error / result.state.covariance(StateBlock::kP + 2, StateBlock::kP + 2);
      count += 1.0;
    }
  }
  std::printf("height with a barometer: %.2f\n", nees / count);
  // A walk of the bias is about one sample a run: six of them scatter by 0.6.
  EXPECT_GT(nees / count, 0.4);
  EXPECT_LT(nees / count, 2.2);
}

// No sensor corrects the position along the ground, but the barometer corrects the height.
TEST(Barometer, MendsTheHeightThatADivergenceLeftUncertain) {
  DroneRun run(1, 70.0, true);
  run.options.health.on_divergence = OnDivergence::kReport;
  run.run([&](simulation::SensorData& data) {
    for (ImuMeasurement& sample : data.imu.samples)
      if (run.seconds(sample.time) > 35.0 && run.seconds(sample.time) < 38.0) sample.acceleration.x() += 1.0;
  });
  EXPECT_GE(run.odometry->faults()["diverged"], 1U);
  const NavigationState& end = run.states.back();
  const Eigen::Vector3d sigma = end.covariance.diagonal().segment<3>(StateBlock::kP).cwiseSqrt();
  EXPECT_GT(sigma.head<2>().minCoeff(), 1.0);
  EXPECT_LT(sigma.z(), 0.5);
  EXPECT_LT(std::abs(run.heightError(end)), 3.0 * sigma.z());
}

TEST(Barometer, OneThatFallsSilentChangesNothingElse) {
  DroneRun run(5, 40.0, true);
  run.run([&](simulation::SensorData& data) {
    for (simulation::SimulatedPressure& pressure : data.pressures)
      if (run.seconds(pressure.stamp) > 20.0 && run.seconds(pressure.stamp) < 30.0) pressure.pascal = 0.0;
  });
  EXPECT_EQ(run.odometry->faults().at("pressure_not_usable"), 500u);
  EXPECT_EQ(run.odometry->health(), Health::kOk);
  EXPECT_GT(run.count(31.0, 40.0, isUsed), 70);
  EXPECT_LT(run.heightRms(30.0, 40.0), 0.3);
}

/// A minute of pressures waits for a node. The older ones are counted, and so are those of the minute that
/// come to no node.
TEST(Barometer, ASilentRadarLeavesNoPressureUnsaid) {
  DroneRun run(2, 100.0, true);
  run.run([&](simulation::SensorData& data) {
    for (simulation::SimulatedScan& scan : data.scans)
      if (run.seconds(scan.stamp) > 20.0 && run.seconds(scan.stamp) < 90.0) scan.delivered = false;
  });
  EXPECT_NEAR(static_cast<double>(run.odometry->faults()["pressure_without_node"]), 100.0, 20.0);
  const auto is_late = [](const BarometerAnswer& answer) {
    return answer.rejected_because == "older_than_window" || answer.rejected_because == "no_node_near";
  };
  EXPECT_GT(run.count(20.0, 90.0, is_late), 550);
}

/// Its means are farther apart than the window is long. After a shock they are used again.
TEST(Barometer, ASlowOneIsUsedAgainAfterAShock) {
  DroneRun run(4, 95.0, true);
  run.setup.barometer.rate = 1.0 / 1.3;
  run.setup.barometer.noise = 0.3;
  run.setup.barometer.shocks = {{25.0, 4.0, 100.0}};
  run.run();
  EXPECT_GT(run.count(6.0, 25.0, isUsed), 12);
  EXPECT_GE(run.count(25.0, 29.0, isShock), 2);
  EXPECT_GT(run.count(75.0, 95.0, isUsed), 12);
}

TEST(Barometer, ASlowOneShowsASlope) {
  DroneRun run(4, 95.0, true);
  run.setup.barometer.rate = 1.0 / 1.3;
  run.setup.barometer.noise = 0.3;
  run.run([&](simulation::SensorData& data) {
    for (simulation::SimulatedPressure& pressure : data.pressures)
      pressure.pascal += 100.0 * std::clamp((run.seconds(pressure.stamp) - 25.0) / 30.0, 0.0, 1.0);
  });
  EXPECT_EQ(run.count(0.0, 25.0, isMoving), 0);
  EXPECT_GT(run.count(25.0, 55.0, isMoving), 12);
  EXPECT_EQ(run.count(55.0, 95.0, isStep), 1);
  EXPECT_GT(run.count(75.0, 95.0, isUsed), 12);
}

/// The pressure moves, falls silent, and is the old one when it is back.
TEST(Barometer, ASilenceIsNoRest) {
  DroneRun run(4, 90.0, true);
  run.setup.barometer.shocks = {{25.0, 30.0, 36.0}};
  run.run([&](simulation::SensorData& data) {
    for (simulation::SimulatedPressure& pressure : data.pressures)
      if (run.seconds(pressure.stamp) > 27.0 && run.seconds(pressure.stamp) < 80.0) pressure.pascal = 0.0;
  });
  EXPECT_GT(run.count(25.0, 27.0, isMoving), 5);
  EXPECT_GT(run.count(80.0, 84.0, isMoving), 30);
  EXPECT_EQ(run.count(80.0, 90.0, isStep), 0);
  EXPECT_GT(run.count(86.0, 90.0, isUsed), 30);
}

TEST(Barometer, ASampleAfterASilenceTellsNoMore) {
  DroneRun run(2, 30.0, true);
  run.run([&](simulation::SensorData& data) {
    auto& pressures = data.pressures;
    pressures.erase(std::remove_if(pressures.begin(), pressures.end(),
                                   [&](const auto& pressure) {
                                     return std::fmod(run.seconds(pressure.stamp), 5.0) > 3.0;
                                   }),
                    pressures.end());
  });
  double least = 1.0;
  for (const ScanResult& result : run.results)
    for (const BarometerAnswer& mean : result.barometer)
      if (isUsed(mean)) least = std::min(least, mean.innovation_sigma);
  EXPECT_GT(least, 0.05 / std::sqrt(0.15));  // at most 0.15 s of the noise of the options
}

/// The mean sigma [m] of the innovations, with the stamps that `stampOf` gives to the samples by number.
double innovationSigma(const std::function<double(int)>& stamp_of) {
  DroneRun run(2, 30.0, true);
  run.run([&](simulation::SensorData& data) {
    int k = 0;
    for (simulation::SimulatedPressure& pressure : data.pressures)
      pressure.stamp = run.setup.start + stamp_of(k++);
  });
  double sum = 0.0, count = 0.0;
  for (const ScanResult& result : run.results)
    for (const BarometerAnswer& mean : result.barometer) {
      if (run.seconds(mean.time) < 10.0) continue;
      sum += mean.innovation_sigma;
      count += 1.0;
    }
  EXPECT_GT(count, 50.0);
  return sum / count;
}

TEST(Barometer, SamplesThatComeInPairsTellAsMuch) {
  const double regular = innovationSigma([](int k) { return 0.01 + 0.02 * k; });
  const double pairs = innovationSigma([](int k) { return 0.01 + 0.02 * (k - k % 2) + 0.001 * (k % 2); });
  EXPECT_LT(pairs, 1.5 * regular);
  EXPECT_GT(pairs, regular / 1.5);
}

TEST(Barometer, OffItTakesNothing) {
  DroneRun without(1, 30.0, false);
  without.run();
  SimulatedRun never("drone", 1, 30.0, 5.0);
  never.run();
  ASSERT_EQ(without.states.size(), never.states.size());
  EXPECT_EQ(without.states.back().p_W, never.states.back().p_W);
  EXPECT_EQ(without.count(0.0, 30.0, [](const BarometerAnswer&) { return true; }), 0);
}

}  // namespace
}  // namespace rio_t
