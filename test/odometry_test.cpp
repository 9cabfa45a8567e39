// The whole pipeline without ROS: faults of the input, causality, repeatability.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "noise.h"
#include "rio_t/odometry/batch_odometry.h"
#include "rio_t/odometry/navigation.h"
#include "rio_t/odometry/radar_inertial_odometry.h"
#include "simulated_run.h"

namespace rio_t {
namespace {

/// At rest on the ground: gravity up, no rotation.
ImuMeasurement restSample(double t) {
  return {Time::fromSeconds(t), Eigen::Vector3d::Zero(), {0.0, 0.0, 9.81}};
}

RadarScan restScan(double t) {
  RadarScan scan;
  scan.stamp = Time::fromSeconds(t);
  for (int i = 0; i < 20; ++i) {
    scan.points.push_back({{3.0 * std::sin(0.3 * i), 4.0, std::cos(1.7 * i)}, 0.0, 20.0});
  }
  return scan;
}

class AtRest : public ::testing::Test {
 protected:
  AtRest() : odometry(OdometryOptions()) {}
  /// Feeds rest at 200 Hz up to `until`; the results of the scans finished on the way.
  std::vector<ScanResult> run(double until) {
    std::vector<ScanResult> results;
    for (; time < until - 1e-6; time += 0.005) {
      if (const auto state = odometry.addImu(restSample(time)).state) states.push_back(*state);
      for (ScanResult& result : odometry.process()) results.push_back(std::move(result));
    }
    return results;
  }
  RadarInertialOdometry odometry;
  double time = 100.0;
  std::vector<NavigationState> states;
};

TEST_F(AtRest, SaysWhatItWaitsForThenStaysWhereItIs) {
  run(101.0);
  EXPECT_FALSE(odometry.initialized());
  EXPECT_NE(odometry.waitingFor().text.find("standing still"), std::string::npos)
      << odometry.waitingFor().text;
  run(104.0);
  ASSERT_TRUE(odometry.initialized());
  for (int i = 0; i < 20; ++i) {
    odometry.addScan(restScan(time - 0.05));
    for (const ScanResult& result : run(time + 0.1)) EXPECT_TRUE(result.used) << result.rejected_because;
  }
  EXPECT_LT(states.back().p_W.norm(), 1e-3);
  EXPECT_EQ(states.back().time, Time::fromSeconds(time - 0.005));
}

TEST_F(AtRest, AScanWaitsUntilTheImuCoversIt) {
  run(104.0);
  odometry.addScan(restScan(104.1));
  EXPECT_TRUE(odometry.process().empty());
  EXPECT_TRUE(run(104.205).empty()) << "the derivative by t_O looks 0.1 s ahead";
  const auto results = run(104.25);
  ASSERT_EQ(results.size(), 1u);
  EXPECT_TRUE(results[0].used) << results[0].rejected_because;
}

TEST_F(AtRest, EveryScanIsAccountedFor) {
  odometry.addScan(restScan(100.0));
  EXPECT_EQ(run(100.1).at(0).rejected_because, "before_initialization");
  run(104.0);
  odometry.addScan(restScan(100.0));
  EXPECT_EQ(run(104.1).at(0).rejected_because, "before_initialization");
  odometry.addScan(restScan(108.0));
  EXPECT_EQ(run(104.2).at(0).rejected_because, "stamp_ahead_of_imu");
  RadarScan empty;
  empty.stamp = Time::fromSeconds(104.15);
  odometry.addScan(empty);
  EXPECT_EQ(run(104.3).at(0).rejected_because, "too_few_points");
  odometry.addScan(restScan(104.2));
  odometry.addScan(restScan(104.2));
  const auto twice = run(104.4);
  ASSERT_EQ(twice.size(), 2u);
  EXPECT_TRUE(twice[0].used);
  EXPECT_EQ(twice[1].rejected_because, "duplicate_stamp");
  odometry.addScan(restScan(104.9));
  EXPECT_TRUE(run(104.5).empty());
  EXPECT_EQ(odometry.finish().at(0).rejected_because, "imu_not_covering");
}

TEST_F(AtRest, AScanMayOvertakeTheSampleThatStartsTheEstimate) {
  for (const double overtakes_by : {-0.03, 0.01, 0.3}) {
    odometry = RadarInertialOdometry(OdometryOptions());
    time = 100.0;
    while (!odometry.initialized()) run(time + 0.005);
    const double start = time;
    odometry = RadarInertialOdometry(OdometryOptions());
    time = 100.0;
    run(start + 0.02 - overtakes_by);
    odometry.addScan(restScan(start + 0.02));
    const std::vector<ScanResult> results = run(start + 0.2);
    ASSERT_EQ(results.size(), 1u) << overtakes_by;
    EXPECT_TRUE(results[0].used) << overtakes_by << ": " << results[0].rejected_because;
  }
}

TEST_F(AtRest, AScanOfAnUnknownRadarIsRefused) {
  RadarScan scan = restScan(100.0);
  scan.radar = 1;
  EXPECT_THROW(odometry.addScan(scan), std::invalid_argument);
}

// The IMU may fall silent for as long as its gaps are bridged. The radar goes on meanwhile.
TEST_F(AtRest, ScansOfAnImuGapWaitForItsEnd) {
  run(104.0);
  odometry.addScan(restScan(106.0));
  EXPECT_TRUE(odometry.process().empty());
  time = 106.5;
  const auto results = run(106.6);
  ASSERT_EQ(results.size(), 1u);
  EXPECT_TRUE(results[0].used) << results[0].rejected_because;
}

/// The biases are means over the rest. A gap at its end must not make them vague.
TEST_F(AtRest, AGapAsTheRestEndsTakesNothingFromTheBias) {
  run(102.95);
  time = 103.06;
  run(103.1);
  ASSERT_TRUE(odometry.initialized());
  EXPECT_LT(std::sqrt(states.back().covariance(StateBlock::kBg + 2, StateBlock::kBg + 2)), 2e-3);
}

TEST_F(AtRest, TooManyWaitingScansAreReportedNotLost) {
  run(104.0);
  OdometryOptions options;
  std::size_t finished = 0;
  for (std::size_t i = 0; i < options.max_queued_scans + 3; ++i) {
    odometry.addScan(restScan(104.2 + 1e-3 * static_cast<double>(i)));
    for (const ScanResult& result : odometry.process()) {
      EXPECT_EQ(result.rejected_because, "queue_full");
      ++finished;
    }
  }
  EXPECT_EQ(finished, 3u);
}

TEST_F(AtRest, BadImuSamplesAreDroppedAndCounted) {
  run(104.0);
  EXPECT_FALSE(odometry.addImu(restSample(103.0)).state);
  ImuMeasurement bad = restSample(time);
  bad.acceleration.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(odometry.addImu(bad).state);
  EXPECT_TRUE(odometry.addImu(restSample(time + 0.5)).state);
  const auto faults = odometry.faults();
  EXPECT_EQ(faults.at("imu_out_of_order"), 1u);
  EXPECT_EQ(faults.at("imu_not_finite"), 1u);
  EXPECT_EQ(faults.at("imu_gap"), 1u);
}

TEST_F(AtRest, ASilentRadarIsCountedOnceEachTime) {
  run(104.0);
  EXPECT_EQ(odometry.faults().at("radar_gap"), 1u) << "none came yet";
  odometry.addScan(restScan(time - 0.05));
  run(106.0);
  EXPECT_EQ(odometry.faults().at("radar_gap"), 2u);
}

TEST_F(AtRest, WithoutScansTheWindowMovesOn) {
  run(104.0);
  std::vector<StampedPose> left;
  const auto scanAndRun = [&](double until) {
    odometry.addScan(restScan(time - 0.05));
    const std::vector<ScanResult> results = run(until);
    ASSERT_EQ(results.size(), 1u);
    EXPECT_TRUE(results[0].used) << results[0].rejected_because;
    left.insert(left.end(), results[0].left_window.begin(), results[0].left_window.end());
  };
  while (time < 106.0) scanAndRun(time + 0.1);
  EXPECT_TRUE(run(160.0).empty());
  // A window that stood still would keep all of the IMU since the last scan.
  scanAndRun(160.1);
  ASSERT_FALSE(left.empty());
  EXPECT_GT(left.back().time - Time::fromSeconds(0.0), 145.0);
  for (std::size_t i = 1; i < left.size(); ++i) {
    EXPECT_GT(left[i].time - left[i - 1].time, 0.0);
    EXPECT_LT(left[i].time - left[i - 1].time, 5.1);
  }
  // And a scan that is late finds its place.
  odometry.addScan(restScan(time - 0.9));
  const std::vector<ScanResult> late = run(160.2);
  ASSERT_EQ(late.size(), 1u);
  EXPECT_TRUE(late[0].used) << late[0].rejected_because;
}

TEST_F(AtRest, AClockThatJumpsStartsTheEstimateAgain) {
  run(104.0);
  odometry.addScan(restScan(103.95));
  run(104.1);
  for (const double jump : {-50.0, 1000.0}) {
    time += jump;
    states.clear();
    const double begin = time;
    run(begin + 0.6);
    EXPECT_TRUE(states.empty());
    EXPECT_FALSE(odometry.initialized());
    run(begin + 4.0);
    ASSERT_TRUE(odometry.initialized()) << odometry.waitingFor().text;
    ASSERT_FALSE(states.empty());
    EXPECT_GT(states.front().time, Time::fromSeconds(begin));
    EXPECT_LT(states.back().p_W.norm(), 1e-3);
    odometry.addScan(restScan(time - 0.05));
    const auto results = run(time + 0.1);
    ASSERT_EQ(results.size(), 1u);
    EXPECT_TRUE(results[0].used) << results[0].rejected_because;
    // The poses that were in the window when the clock jumped are not lost.
    const auto& poses = results[0].left_window;
    EXPECT_TRUE(std::any_of(poses.begin(), poses.end(), [&](const StampedPose& pose) {
      return std::abs(pose.time - Time::fromSeconds(begin)) > 10.0;
    })) << jump;
  }
  EXPECT_EQ(odometry.faults().at("imu_clock_restart"), 2u);
}

TEST_F(AtRest, AScanThatWaitsForAClockThatEndedIsGivenUp) {
  run(104.0);
  odometry.addScan(restScan(104.05));
  time -= 50.0;
  const std::vector<ScanResult> results = run(time + 0.6);
  ASSERT_EQ(results.size(), 1u);
  // Its velocity must not go to the start on the new clock.
  EXPECT_EQ(results[0].rejected_because, "imu_not_covering");
}

TEST_F(AtRest, ThePosesFromBeforeAJumpAreNotLostAtTheEnd) {
  run(104.0);
  odometry.addScan(restScan(103.95));
  run(104.1);
  time += 1000.0;
  run(time + 0.6);
  ASSERT_FALSE(odometry.initialized());
  const std::vector<ScanResult> last = odometry.finish();
  ASSERT_EQ(last.size(), 1u);
  EXPECT_FALSE(last[0].left_window.empty());
}

TEST_F(AtRest, OneStampFarAheadDoesNotSilenceTheImu) {
  run(104.0);
  EXPECT_FALSE(odometry.addImu(restSample(1e6)).state);
  EXPECT_TRUE(odometry.addImu(restSample(time)).state);
  EXPECT_EQ(odometry.faults().at("imu_stamp_jump"), 1u);
}

TEST(ClockThatStepsBack, LeavesThePositionUncertainByTheWayMeanwhile) {
  constexpr double kSpeed = 2.0, kStep = 0.05;
  Navigation navigation(OdometryOptions(), {0.0, 0.0, -9.81});
  NavigationState start;
  start.time = Time::fromSeconds(100.0);
  start.v_W.x() = kSpeed;
  navigation.add(restSample(100.0));
  navigation.anchor(start, false, ImuNoise(), start.time, 0);
  const auto feed = [&](double from, double to) {
    for (double t = from; t < to - 1e-6; t += 0.005) navigation.add(restSample(t));
  };
  const auto sigma = [&] {
    return std::sqrt(navigation.state()->covariance(StateBlock::kP, StateBlock::kP));
  };
  feed(100.005, 101.0);
  const double before = sigma();
  feed(101.0 - kStep, 101.05);
  EXPECT_NEAR(std::sqrt(sigma() * sigma() - before * before), kSpeed * kStep, 0.02);
}

TEST(ClockThatStepsBack, LeavesTheBatchUncertainToo) {
  constexpr double kAt = 30.0;  // [s]
  const auto sigmaAtEnd = [](double step) {
    SimulatedRun run("constant_speed", 1, 35.0);
    const auto stepBack = [&](simulation::SensorData& data) {
      const auto shift = [&](Time& stamp) {
        if (run.seconds(stamp) > kAt) stamp = stamp - step;
      };
      for (ImuMeasurement& sample : data.imu.samples) shift(sample.time);
      for (simulation::SimulatedScan& scan : data.scans) {
        shift(scan.stamp);
        shift(scan.arrival);
      }
    };
    run.run(stepBack);
    EXPECT_EQ(run.odometry->faults().count("imu_clock_back"), step > 0.0 ? 1u : 0u);
    BatchOdometry batch(run.options, BatchOptions());
    batch.addImu(run.taken);
    for (const ScanResult& result : run.results) batch.addResult(result);
    const StateCovariance P = batch.solve(*run.odometry->start()).trajectory.back().covariance;
    return std::sqrt(P(StateBlock::kP, StateBlock::kP));
  };
  const double step = 0.1, without = sigmaAtEnd(0.0), with = sigmaAtEnd(step);
  const double speed = 1.0;  // [m/s] of the motion "constant_speed"
  EXPECT_NEAR(std::sqrt(with * with - without * without), speed * step, 0.2 * speed * step);
}

TEST_F(AtRest, UncertaintyGrowsOverAnImuGap) {
  run(104.0);
  const StateCovariance before = states.back().covariance;
  EXPECT_FALSE(odometry.addImu(restSample(time + 0.995)).state) << "it may be a stamp out of place";
  const auto after = odometry.addImu(restSample(time + 1.0)).state;
  ASSERT_TRUE(after);
  // Half a radian and metres a second may have come together in a second.
  EXPECT_GT(std::sqrt(after->covariance(0, 0)), 0.3);
  EXPECT_GT(std::sqrt(after->covariance(6, 6)), 1.0);
  EXPECT_LT(std::sqrt(before(0, 0)), 0.05);
}

TEST_F(AtRest, UncertaintyGrowsWithoutRadar) {
  run(104.0);
  const double before = states.back().covariance(3, 3);
  run(109.0);
  EXPECT_GT(states.back().covariance(3, 3), 100.0 * before);
  EXPECT_TRUE(states.back().covariance.allFinite());
}

TEST_F(AtRest, NothingIsLearntOfTheOffset) {
  run(104.0);
  ScanResult last;
  while (time < 134.0) {
    odometry.addScan(restScan(time));
    for (ScanResult& result : run(time + 0.1)) last = std::move(result);
  }
  ASSERT_TRUE(last.used) << last.rejected_because;
  const CalibrationPrior configured;
  EXPECT_NEAR(last.time_offset, configured.time_offset_initial, 1e-4);
  EXPECT_GE(last.time_offset_sigma, configured.time_offset_sigma * (1.0 - 1e-6));
}

struct LateScans {
  int wrong = 0, wrong_used = 0;
  int good = 0, good_used = 0;
};

/// Every fifth scan from 15 s on comes `delay` [s] later than it should. Half of these are wrong by 1.8 m/s.
LateScans lateScans(double delay) {
  SimulatedRun run("medium", 3, 40.0, 5.0);
  std::set<Time> wrong, good;
  run.run([&](simulation::SensorData& data) {
    for (std::size_t i = 150; i < data.scans.size(); i += 5) {
      simulation::SimulatedScan& scan = data.scans[i];
      scan.arrival = scan.arrival + delay;
      if (i % 10 != 0) {
        good.insert(scan.stamp);
        continue;
      }
      for (simulation::SimulatedPoint& point : scan.points)
        point.doppler -= point.position_R.normalized().dot(Eigen::Vector3d(1.2, 1.0, 0.9));
      wrong.insert(scan.stamp);
    }
    std::stable_sort(data.scans.begin(), data.scans.end(),
                     [](const auto& a, const auto& b) { return a.arrival < b.arrival; });
  });
  LateScans late;
  for (const ScanResult& result : run.results) {
    const int used = result.used ? 1 : 0;
    if (wrong.count(result.scan.stamp) > 0) ++late.wrong, late.wrong_used += used;
    if (good.count(result.scan.stamp) > 0) ++late.good, late.good_used += used;
  }
  return late;
}

TEST(LateScans, PassTheSameGatesAsPunctualOnes) {
  for (const double delay : {0.0, 0.25, 0.4}) {
    const auto [wrong, wrong_used, good, good_used] = lateScans(delay);
    EXPECT_GT(wrong, 20);
    EXPECT_EQ(wrong_used, 0) << "of " << wrong << ", " << delay << " s late";
    EXPECT_GT(good, 20);
    EXPECT_GT(good_used, 0.8 * good) << "of " << good << ", " << delay << " s late";
  }
}

/// The last scan before the start of a motion comes when the platform moves.
TEST(LateScans, OfARestThatIsOverDoNotStopThePlatform) {
  SimulatedRun run("medium", 3, 14.0, 8.0);
  Time late;
  run.run([&](simulation::SensorData& data) {
    simulation::SimulatedScan* last = nullptr;
    for (simulation::SimulatedScan& scan : data.scans)
      if (run.seconds(scan.stamp) < 7.7) last = &scan;
    late = last->stamp;
    last->arrival = late + 0.9;
    std::stable_sort(data.scans.begin(), data.scans.end(),
                     [](const auto& a, const auto& b) { return a.arrival < b.arrival; });
  });
  const auto result = std::find_if(run.results.begin(), run.results.end(),
                                   [&](const ScanResult& each) { return each.scan.stamp == late; });
  ASSERT_NE(result, run.results.end());
  EXPECT_TRUE(result->at_rest);
  const double speed = run.truth(result->state).v_W.norm();
  EXPECT_GT(speed, 0.02);
  EXPECT_GT(result->state.v_W.norm(), 0.5 * speed);
}

// Both solvers and both models of the offset, through everything.
TEST(Solvers, SayTheSame) {
  for (const TimeOffsetModel model : {TimeOffsetModel::kImu, TimeOffsetModel::kConstantAcceleration}) {
    std::vector<ScanResult> last;
    std::vector<std::size_t> used;
    for (const WindowSolver solver : {WindowSolver::kChain, WindowSolver::kCeres}) {
      SimulatedRun run("difficult", 1, 25.0);
      run.setup.time_offset.constant = 0.03;
      run.options.smoother.time_offset_model = model;
      run.options.smoother.solver = solver;
      run.run();
      used.push_back(0);
      for (const ScanResult& result : run.results) {
        if (!result.used) continue;
        ++used.back();
        EXPECT_TRUE(isConverged(result.solver_termination)) << toString(result.solver_termination);
      }
      last.push_back(run.results.back());
    }
    EXPECT_EQ(used[0], used[1]);
    const double position_sigma =
        std::sqrt(last[0].state.covariance.block<3, 3>(StateBlock::kP, StateBlock::kP).trace());
    EXPECT_LT((last[0].state.p_W - last[1].state.p_W).norm(), 0.1 * position_sigma);
    EXPECT_NEAR(last[0].time_offset, last[1].time_offset, 0.1 * last[0].time_offset_sigma);
    EXPECT_NEAR(last[0].time_offset_sigma, last[1].time_offset_sigma, 0.02 * last[0].time_offset_sigma);
  }
}

/// Wild motion in which a gyro axis reads 17.4 rad/s for 0.3 s.
TEST(StuckGyro, CostsLittle) {
  for (const int axis : {0, 1, 2}) {
    SimulatedRun run("difficult", 1, 60.0, 5.0);
    run.run([&](simulation::SensorData& data) {
      for (ImuMeasurement& sample : data.imu.samples) {
        const double t = run.seconds(sample.time);
        if (t >= 30.0 && t < 30.3) sample.angular_velocity[axis] = 17.4;
      }
    });
    const auto error = [&](const NavigationState& state) { return run.wayError(state).norm(); };
    EXPECT_LT(run.rms(10.0, 60.0, error), 0.18) << "axis " << axis << ", 0.12 m without the fault";
    // No sensor gives the heading back: 0.04 to 0.08 rad are lost.
    const auto turn = [&](const NavigationState& state) {
      return state.q_WI.angularDistance(run.turnIntoW() * run.truth(state).q_WI);
    };
    EXPECT_LT(run.rms(32.0, 60.0, turn), 0.12) << "axis " << axis;
    EXPECT_GT(run.odometry->faults()["imu_stuck"], 50u);
    EXPECT_LT(run.rms(32.0, 60.0, [&](const NavigationState& state) { return run.velocityError(state); }),
              0.1);
  }
}

TEST(ImuSpike, OneImpossibleSampleCostsNothing) {
  SimulatedRun run("difficult", 1, 40.0, 5.0);
  run.run([&](simulation::SensorData& data) {
    auto& samples = data.imu.samples;
    samples[samples.size() / 2].acceleration.x() = 1e4;
  });
  EXPECT_EQ(run.odometry->faults()["imu_not_plausible"], 1u);
  EXPECT_EQ(run.odometry->faults()["diverged"], 0u);
  EXPECT_LT(run.rms(15.0, 40.0, [&](const NavigationState& state) { return run.velocityError(state); }), 0.1);
}

/// The IMU says that the velocity jumped by 0.5 and 2.5 m/s, and no other sample confirms it.
TEST(ImuSpike, OneWrongSampleIsOutvotedAtOnce) {
  for (const double spike : {200.0, 1000.0}) {
    SimulatedRun run("difficult", 1, 40.0, 5.0);
    run.run([&](simulation::SensorData& data) {
      auto& samples = data.imu.samples;
      samples[samples.size() / 2].acceleration.x() += spike;
    });
    EXPECT_LT(run.rms(25.0, 40.0, [&](const NavigationState& state) { return run.velocityError(state); }),
              0.1)
        << spike;
  }
}

/// The gap loses the heading for good, and with it the direction of the velocity in W. At this speed that is
/// metres per second, but the motion is known all the same.
TEST(ImuGap, AtSpeedIsNoDivergence) {
  simulation::MotionRequest request;
  request.name = "constant_speed";
  request.duration = 40.0;
  request.speed = 8.0;
  request.rest.static_start = 5.0;
  SimulatedRun run("constant_speed", 1, 40.0, 5.0);
  run.motion = simulation::makeMotion(request);
  run.run([&](simulation::SensorData& data) {
    std::vector<ImuMeasurement>& samples = data.imu.samples;
    const auto in_gap = [&](const ImuMeasurement& sample) {
      return run.seconds(sample.time) > 15.0 && run.seconds(sample.time) < 17.0;
    };
    samples.erase(std::remove_if(samples.begin(), samples.end(), in_gap), samples.end());
  });
  int states = 0;
  for (const NavigationState& state : run.states) {
    if (run.seconds(state.time) < 18.0 || run.seconds(state.time) > 30.0) continue;
    ++states;
    ASSERT_GT(std::sqrt(state.covariance(StateBlock::kV + 1, StateBlock::kV + 1)), 2.0);
  }
  EXPECT_GT(states, 2000);
  EXPECT_LT(run.rms(18.0, 40.0, [&](const NavigationState& state) { return run.velocityError(state); }), 0.1);
  int scans = 0, used = 0;
  for (const ScanResult& result : run.results) {
    const double t = run.seconds(result.scan.stamp);
    EXPECT_FALSE(t > 17.5 && result.health == Health::kDiverged) << t;
    if (t < 18.0) continue;
    ++scans;
    used += result.used ? 1 : 0;
  }
  EXPECT_GT(scans, 200);
  EXPECT_GT(used, 0.9 * scans);
}

/// An engine that is off at the end must not make the run look quiet.
TEST(Vibration, NoiseOfTheRunIsNotThatOfItsEnd) {
  Navigation navigation(OdometryOptions(), Eigen::Vector3d(0.0, 0.0, -9.81));
  Noise draw;
  constexpr double kRate = 100.0;
  for (int i = 0; i < 2000; ++i) {
    const double sigma = i < 1000 ? 1.0 : 0.01;
    navigation.add({Time::fromSeconds(10.0 + i / kRate), Eigen::Vector3d::Zero(),
                    Eigen::Vector3d(0.0, 0.0, 9.81) + sigma * draw.vector()});
  }
  const double density = 1.0 / std::sqrt(kRate);
  EXPECT_LT(navigation.imuNoise().accel_density, 0.1 * density);
  EXPECT_NEAR(navigation.imuNoiseOfRun().accel_density, std::sqrt(0.5) * density, 0.2 * density);
}

/// Straight ahead at 3 m/s on a frame that vibrates, then at rest.
TEST(Vibration, AfterBrakingThePlatformIsAtRest) {
  for (const double imu_rate : {100.0, 400.0}) {
    for (const double vibration : {0.3, 0.8, 2.0}) {
      simulation::MotionRequest request;
      request.name = "constant_speed";
      request.duration = 40.0;
      request.speed = 3.0;
      request.rest.static_start = 5.0;
      request.rest.static_end = 4.0;
      SimulatedRun run("constant_speed", 1, 40.0, 5.0);
      run.motion = simulation::makeMotion(request);
      run.setup.imu.rate = imu_rate;
      run.setup.imu.accel_vibration = vibration;
      run.setup.time_offset.constant = 0.03;
      run.run();
      const auto error = [&](const NavigationState& state) { return run.velocityError(state); };
      EXPECT_LT(run.rms(37.5, 40.0, error), 0.05) << vibration << " m/s^2 at " << imu_rate << " Hz";
      EXPECT_EQ(run.odometry->faults()["diverged"], 0u);
    }
  }
}

}  // namespace
}  // namespace rio_t
