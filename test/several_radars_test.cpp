// Several radars on one rig, and mountings that are estimated, through the whole pipeline.
#include <gtest/gtest.h>

#include <cmath>

#include "rio_t/core/angle.h"
#include "rio_t/core/so3.h"
#include "rio_t/evaluation/errors.h"
#include "rio_t/simulation/presets.h"
#include "simulated_run.h"

namespace rio_t {
namespace {

/// Looks forward (yaw 0), and turned about the vertical and up. R: right, forward, up; I: forward, left, up.
Eigen::Quaterniond looking(double yaw_deg, double pitch_deg) {
  const Eigen::AngleAxisd yaw(yaw_deg * kDegree, Eigen::Vector3d::UnitZ());
  const Eigen::AngleAxisd up(-pitch_deg * kDegree, Eigen::Vector3d::UnitY());
  const Eigen::AngleAxisd forward(-0.5 * M_PI, Eigen::Vector3d::UnitZ());  // y of R is x of I
  return Eigen::Quaterniond(yaw * up * forward);
}

/// Two radars, left and right, that are told as they are.
SimulatedRun pair(const std::string& motion, std::uint64_t seed, double duration) {
  SimulatedRun run(motion, seed, duration, 5.0);
  for (const auto& [name, side] : {std::pair{"left", 1.0}, std::pair{"right", -1.0}}) {
    simulation::RadarSetup& radar = run.setup.radars[name];
    radar.T_IR = {{0.1, 0.1 * side, 0.02}, looking(40.0 * side, 0.0)};
    radar.time_offset.constant = side > 0.0 ? -0.009 : 0.040;
    RadarOptions told;
    told.T_IR = radar.T_IR;
    run.options.radars.push_back(told);
  }
  return run;
}

double turnDegrees(const Extrinsics& a, const Extrinsics& b) {
  return a.q_IR.angularDistance(b.q_IR) / kDegree;
}

/// [m] With the origins aligned.
double ate(const SimulatedRun& run) {
  Trajectory truth, estimate;
  for (const NavigationState& state : run.states) {
    const simulation::MotionState true_state = run.truth(state);
    truth.push_back({state.time, true_state.p_W, true_state.q_WI});
    estimate.push_back({state.time, state.p_W, state.q_WI});
  }
  return absoluteError(truth, estimate, Alignment::kOrigin).translation_m.rmse;
}

TEST(TwoRadars, EachHasItsOffset) {
  for (const std::uint64_t seed : {1, 2}) {
    SimulatedRun run = pair("difficult", seed, 60.0);
    run.run();
    for (const auto& [radar, truth] : {std::pair{0U, -0.009}, std::pair{1U, 0.040}}) {
      const ScanResult& last = run.last(radar);
      EXPECT_NEAR(last.time_offset, truth, 5e-4) << "radar " << radar << ", seed " << seed;
      EXPECT_LT(std::abs(last.time_offset - truth), 2.6 * last.time_offset_sigma) << radar;
    }
  }
}

// One is told 15 degrees wrong. The estimate lies between the two, and both contradict it.
TEST(TwoRadars, TheOneWhoseMountingIsWrongIsNamed) {
  for (const char* motion : {"medium", "drone"}) {
    SimulatedRun run = pair(motion, 1, 50.0);
    run.options.radars[0].T_IR.q_IR = looking(55.0, 0.0);
    run.run();
    const Eigen::Vector3d left = run.last(0).errors.turn->error / kDegree;
    const Eigen::Vector3d right = run.last(1).errors.turn->error / kDegree;
    EXPECT_LT(left.z(), -7.5) << motion;  // the offset takes a part
    EXPECT_LT(left.head<2>().norm(), 3.0) << motion << ": " << left.transpose();
    EXPECT_LT(right.norm(), 3.0) << motion << ": " << right.transpose();
  }
}

// A live node takes the IMU samples in bunches, as threads happen to run; the bag runner one by one. The two
// offsets differ, so the scans do not get ready in the order in which they come.
TEST(TwoRadars, AreUsedInTheSameOrderHoweverTheImuComes) {
  SimulatedRun one_by_one = pair("difficult", 1, 20.0);
  SimulatedRun bunched = pair("difficult", 1, 20.0);
  bunched.samples_per_process = 50;
  one_by_one.run();
  bunched.run();
  ASSERT_GT(bunched.results.size(), 200u);
  for (std::size_t k = 0; k < bunched.results.size(); ++k) {
    const ScanResult &a = one_by_one.results.at(k), &b = bunched.results[k];
    ASSERT_EQ(a.scan.radar, b.scan.radar) << "scan " << k;
    ASSERT_EQ(a.scan.stamp, b.scan.stamp) << "scan " << k;
    ASSERT_EQ(a.state.p_W, b.state.p_W) << "scan " << k;
    ASSERT_EQ(a.time_offset, b.time_offset) << "scan " << k;
  }
}

// When the data end, some scans still wait. They are used in the order of measurement, too.
TEST(TwoRadars, AreUsedInTheSameOrderAtTheEnd) {
  SimulatedRun run = pair("difficult", 1, 20.0);
  run.run();
  const Time newest = run.states.back().time;
  // Both wait for the IMU's margin. The right one's offset is larger, so it was measured first.
  for (const std::size_t radar : {0u, 1u}) {
    RadarScan scan;
    scan.radar = radar;
    scan.stamp = newest + 0.001;
    run.odometry->addScan(scan);
  }
  std::vector<std::size_t> order;
  for (const ScanResult& result : run.odometry->finish())
    if (result.scan.stamp == newest + 0.001) order.push_back(result.scan.radar);
  EXPECT_EQ(order, (std::vector<std::size_t>{1, 0}));
}

// At rest nothing tells the offsets: the sigma of each grows by its random walk alone.
TEST(TwoRadars, TheOffsetsOfBothWander) {
  SimulatedRun run = pair("medium", 1, 50.0);
  run.motion = SimulatedRun::makeMotion("medium", 1, 50.0, 40.0);
  for (RadarOptions& radar : run.options.radars) radar.time_offset_sigma = 0.001;
  run.options.smoother.time_offset_noise = 0.001;
  run.run([&](simulation::SensorData& data) {
    const auto moves = [&](const ImuMeasurement& sample) { return run.seconds(sample.time) > 39.0; };
    auto& samples = data.imu.samples;
    samples.erase(std::find_if(samples.begin(), samples.end(), moves), samples.end());
  });
  for (const std::size_t radar : {0, 1})
    EXPECT_NEAR(run.last(radar).time_offset_sigma, 0.001 * std::sqrt(1.0 + 35.0), 5e-4) << "radar " << radar;
}

TEST(TwoRadars, WithOneClockShareTheOffset) {
  SimulatedRun run = pair("medium", 1, 40.0);
  SimulatedRun apart = pair("medium", 1, 40.0);
  for (SimulatedRun* each : {&run, &apart})
    for (auto& [name, radar] : each->setup.radars) radar.time_offset.constant = 0.03;
  run.options.smoother.time_offset_shared = true;
  run.run();
  apart.run();
  // The same block, so between two scans it only moves by what the later scan says.
  EXPECT_NEAR(run.last(0).time_offset, run.last(1).time_offset, 1e-4);
  EXPECT_LT(std::abs(run.last(0).time_offset - 0.03), 2.6 * run.last(0).time_offset_sigma);
  EXPECT_LT(run.last(0).time_offset_sigma, 0.85 * apart.last(0).time_offset_sigma);
}

TEST(TwoRadars, AStepOfTheirClockIsOneStep) {
  SimulatedRun run = pair("difficult", 1, 60.0);
  for (auto& [name, radar] : run.setup.radars) {
    radar.time_offset.constant = 0.03;
    radar.time_offset.steps = {{35.0, 0.1}};
  }
  run.options.smoother.time_offset_shared = true;
  run.options.radar.time_offset_sigma = 1e-4;  // of no radar, since there are several
  run.run();
  EXPECT_EQ(run.odometry->faults()["time_offset_step"], 1U);
  for (const std::size_t radar : {0, 1})
    EXPECT_LT(std::abs(run.last(radar).time_offset - 0.13), 2.6 * run.last(radar).time_offset_sigma) << radar;
}

/// What one radar does for 10 s must not pull down the other.
TEST(TwoRadars, OneThatFailsDoesNotPullDownTheOther) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    SimulatedRun both = pair("medium", seed, 60.0);
    both.run();
    SimulatedRun silent = pair("medium", seed, 60.0);
    silent.setup.radars["left"].radar.blackouts = {{25.0, 10.0}};
    silent.run();
    SimulatedRun ghosts = pair("medium", seed, 60.0);
    ghosts.setup.radars["left"].radar.ghost_bursts = {{25.0, 10.0}};
    ghosts.run();
    EXPECT_LT(ate(silent), 1.3 * ate(both)) << seed;
    EXPECT_LT(ate(ghosts), 1.3 * ate(both)) << seed;
    for (SimulatedRun* run : {&silent, &ghosts}) {
      EXPECT_EQ(run->odometry->faults()["diverged"], 0U) << seed;
      EXPECT_EQ(run->odometry->faults()["time_offset_step"], 0U) << seed;
      EXPECT_NEAR(run->last(0).time_offset, -0.009, 2.6 * run->last(0).time_offset_sigma) << seed;
    }
  }
}

TEST(Extrinsics, AreFoundWithTheirSigma) {
  double squares = 0.0;
  int count = 0;
  for (const std::uint64_t seed : {1, 2, 3}) {
    SimulatedRun run = pair("difficult", seed, 60.0);
    run.options.smoother.estimate_extrinsics = EstimateExtrinsics::kPose;
    run.options.radars[0].T_IR.q_IR = so3::exp({0.05, -0.04, 0.06}) * run.options.radars[0].T_IR.q_IR;
    run.options.radars[1].T_IR.l_I.x() += 0.05;
    run.run();
    for (const auto& [radar, name] : {std::pair{0U, "left"}, std::pair{1U, "right"}}) {
      const ScanResult& last = run.last(radar);
      const Extrinsics& truth = run.setup.radars[name].T_IR;
      Eigen::Matrix<double, 6, 1> e;
      e << last.T_IR.l_I - truth.l_I, so3::log(last.T_IR.q_IR * truth.q_IR.conjugate());
      const Eigen::Matrix<double, 6, 1> sigmas = last.T_IR_covariance.diagonal().cwiseSqrt();
      EXPECT_LT(turnDegrees(last.T_IR, truth), 0.5) << name << ", seed " << seed;
      EXPECT_LT(e.head<3>().norm(), 5e-3) << name << ", seed " << seed;
      EXPECT_LT(e.cwiseQuotient(sigmas).cwiseAbs().maxCoeff(), 3.5) << name << ", seed " << seed;
      squares += e.cwiseQuotient(sigmas).squaredNorm();
      count += 6;
    }
  }
  EXPECT_GT(squares / count, 0.5);
  EXPECT_LT(squares / count, 2.0);
}

/// A kart on a flat floor, with a tilt that is told 7 degrees too small or too large.
TEST(Extrinsics, OfASparseRadarAreTheSameFromDifferentStarts) {
  const simulation::Preset preset = simulation::presetOf("kart");
  Extrinsics found[2];
  Eigen::Vector3d sigmas;
  for (const int start : {0, 1}) {
    SimulatedRun run(preset.motion, 2, preset.duration, 2.0);
    run.setup = preset.options;
    run.setup.seed = 2;
    run.options.radar.T_IR = preset.options.T_IR;
    const Eigen::Vector3d turn(0.0, (start == 0 ? 7.0 : -7.0) * kDegree, 3.0 * kDegree);
    run.options.radar.T_IR.q_IR = so3::exp(turn) * run.options.radar.T_IR.q_IR;
    run.options.smoother.estimate_extrinsics = EstimateExtrinsics::kRotation;
    run.run();
    found[start] = run.last(0).T_IR;
    sigmas = run.last(0).T_IR_covariance.diagonal().tail<3>().cwiseSqrt();
    const Eigen::Vector3d e = so3::log(found[start].q_IR * preset.options.T_IR.q_IR.conjugate());
    EXPECT_LT(e.cwiseQuotient(sigmas).cwiseAbs().maxCoeff(), 2.6) << start;
    EXPECT_EQ(run.odometry->faults()["diverged"], 0U) << start;
  }
  EXPECT_LT(turnDegrees(found[0], found[1]), 1.5);
}

/// A minute at a constant speed [m/s], after a rest.
SimulatedRun straightAhead(double speed) {
  simulation::MotionRequest request;
  request.name = "constant_speed";
  request.seed = 1;
  request.duration = 60.0;
  request.speed = speed;
  request.rest.static_start = 5.0;
  request.rest.static_end = 0.0;
  SimulatedRun run(request.name, request.seed, request.duration);
  run.motion = simulation::makeMotion(request);
  return run;
}

TEST(Extrinsics, WithoutExcitationKeepTheirSigma) {
  // A constant speed straight ahead: the turn about the way ahead does not show, nor does the lever arm.
  SimulatedRun run = straightAhead(1.0);
  run.options.smoother.estimate_extrinsics = EstimateExtrinsics::kPose;
  run.run();
  const SmootherOptions& told = run.options.smoother;
  const Eigen::Matrix<double, 6, 1> sigmas = run.last(0).T_IR_covariance.diagonal().cwiseSqrt();
  for (int i = 0; i < 3; ++i) EXPECT_GT(sigmas[i], 0.8 * run.options.radar.extrinsics_translation_sigma) << i;
  // The platform moves along x.
  EXPECT_GT(sigmas[3], 0.7 * told.extrinsics_rotation_sigma);
}

TEST(Extrinsics, VibrationDoesNotShowThem) {
  // The velocity that the window estimates follows the vibration, and does not show the turn about the way
  // ahead.
  const simulation::Preset preset = simulation::presetOf("kart");
  for (const auto radar : {RadarFactor::kDoppler, RadarFactor::kVelocity}) {
    SimulatedRun run = straightAhead(2.0);
    run.setup = preset.options;
    run.setup.seed = 1;
    run.setup.imu.accel_vibration = 1.6;
    run.setup.imu.gyro_vibration = 0.04;
    run.options.radar.T_IR = run.setup.T_IR;
    run.options.smoother.radar_factor = radar;
    run.options.smoother.estimate_extrinsics = EstimateExtrinsics::kPose;
    run.run();
    const SmootherOptions& told = run.options.smoother;
    const Eigen::Matrix<double, 6, 1> sigmas = run.last(0).T_IR_covariance.diagonal().cwiseSqrt();
    EXPECT_GT(sigmas[3], 0.5 * told.extrinsics_rotation_sigma);
    for (int i = 0; i < 3; ++i)
      EXPECT_GT(sigmas[i], 0.9 * run.options.radar.extrinsics_translation_sigma) << i;
  }
}

/// A kart that shakes: the lever arm of a metre turns the vibration of the gyro into velocity.
TEST(Extrinsics, OfAKartThatShakesHaveHonestSigmas) {
  const simulation::Preset preset = simulation::presetOf("kart");
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  constexpr int kSeeds = 6;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    SimulatedRun run(preset.motion, static_cast<std::uint64_t>(seed), 60.0, 2.0);
    run.setup = preset.options;
    run.setup.seed = static_cast<std::uint64_t>(seed);
    run.setup.imu.accel_vibration = 1.6;
    run.setup.imu.gyro_vibration = 0.04;
    run.options.radar.T_IR = preset.options.T_IR;
    run.options.radar.T_IR.q_IR =
        so3::exp(Eigen::Vector3d(0.0, 7.0 * kDegree, 0.0)) * run.options.radar.T_IR.q_IR;
    run.options.smoother.estimate_extrinsics = EstimateExtrinsics::kRotation;
    run.run();
    const Eigen::Vector3d e = so3::log(run.last(0).T_IR.q_IR * preset.options.T_IR.q_IR.conjugate());
    const Eigen::Vector3d sigmas = run.last(0).T_IR_covariance.diagonal().tail<3>().cwiseSqrt();
    squares += e.cwiseQuotient(sigmas).cwiseAbs2() / kSeeds;
  }
  EXPECT_LT(squares.maxCoeff(), 2.5) << squares.transpose();
  EXPECT_LT(squares.mean(), 2.0) << squares.transpose();
}

TEST(Extrinsics, AtRestNothingIsLearnt) {
  SimulatedRun run("medium", 1, 40.0, 30.0);
  run.options.smoother.estimate_extrinsics = EstimateExtrinsics::kPose;
  run.run();
  const auto moving = std::find_if(run.results.begin(), run.results.end(), [&](const ScanResult& result) {
    return run.seconds(result.scan.stamp) > 29.0;
  });
  ASSERT_NE(moving, run.results.end());
  const Eigen::Matrix<double, 6, 1> sigmas = std::prev(moving)->T_IR_covariance.diagonal().cwiseSqrt();
  const SmootherOptions& told = run.options.smoother;
  for (int i = 0; i < 3; ++i) {
    EXPECT_GT(sigmas[i], 0.95 * run.options.radar.extrinsics_translation_sigma) << i;
    EXPECT_GT(sigmas[3 + i], 0.95 * told.extrinsics_rotation_sigma) << i;
  }
}

}  // namespace
}  // namespace rio_t
