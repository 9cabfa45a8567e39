// The gate rejects what contradicts the IMU, and does not stay shut where the prediction is what is wrong.
#include "rio_t/sensors/innovation_gate.h"

#include <gtest/gtest.h>

#include "rio_t/core/so3.h"
#include "rio_t/factors/state_block.h"
#include "simulated_run.h"

namespace rio_t {
namespace {

/// Off by `speed` along x; 0.1 m/s each of prediction and measurement.
Innovation innovation(Time stamp, double speed) {
  Innovation result;
  result.stamp = stamp;
  result.d = {speed, 0.0, 0.0};
  result.S = 0.02 * Eigen::Matrix3d::Identity();
  return result;
}

/// `agreeing` of 20 points support the velocity.
EgoVelocity supportedBy(std::size_t agreeing) {
  EgoVelocity result;
  result.status = EgoVelocityStatus::kMoving;
  result.points.resize(20);
  result.inliers.resize(agreeing);
  return result;
}

class Gate : public ::testing::Test {
 protected:
  static Time at(double seconds) { return Time::fromSeconds(100.0 + seconds); }
  bool rejects(double seconds, double speed, std::size_t agreeing, bool tilt_is_known = true) {
    return gate.rejects({}, innovation(at(seconds), speed), supportedBy(agreeing), tilt_is_known, last_used);
  }
  InnovationGate gate;
  Time last_used = at(0.0);
};

// 0.1 m/s each of prior, measurement and model, four sigmas: 0.69 m/s.
TEST_F(Gate, RejectsWhatContradicts) {
  EXPECT_FALSE(rejects(0.1, 0.65, 14));
  EXPECT_TRUE(rejects(0.2, 0.75, 14));
  EXPECT_TRUE(rejects(0.3, 0.75, 20));
}

TEST_F(Gate, OpensAfterALongTimeWithoutAScan) {
  for (double t = 0.1; t <= 3.0; t += 0.1) EXPECT_TRUE(rejects(t, 2.0, 14)) << t;
  EXPECT_TRUE(rejects(3.05, 2.0, 11));  // points of a wide room agree so by chance
  EXPECT_FALSE(rejects(3.05, 2.0, 14));
}

/// After twelve seconds of ghosts, some of them agree on a velocity of metres a second.
TEST(GateOfARun, StaysShutForGhostsThatAgreeByChance) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SimulatedRun run("medium", seed, 45.0, 5.0);
    run.setup.radar.ghost_bursts = {{20.0, 20.0}};
    run.run();
    for (const NavigationState& state : run.states) {
      const double variance = state.covariance.diagonal().segment<3>(StateBlock::kV).sum();
      ASSERT_LT(run.velocityError(state), 4.0 * std::sqrt(variance))
          << seed << " at " << run.seconds(state.time);
    }
  }
}

TEST_F(Gate, OpensSoonerForScansThatSeeNothingElse) {
  for (double t = 0.1; t < 0.55; t += 0.1) EXPECT_TRUE(rejects(t, 2.0, 19)) << t;
  EXPECT_FALSE(rejects(0.65, 2.0, 19));
}

TEST_F(Gate, OneScanThatIsDividedStartsTheCountAgain) {
  for (double t = 0.1; t < 0.45; t += 0.1) EXPECT_TRUE(rejects(t, 2.0, 19));
  EXPECT_TRUE(rejects(0.5, 2.0, 16));
  for (double t = 0.6; t < 1.05; t += 0.1) EXPECT_TRUE(rejects(t, 2.0, 19)) << t;
  gate.used();
  last_used = at(1.05);
  EXPECT_TRUE(rejects(1.15, 2.0, 19)) << "as does one that is used";
}

TEST_F(Gate, DoesNotJudgeByAPredictionThatIsNotLinear) { EXPECT_FALSE(rejects(0.1, 5.0, 14, false)); }

// Two seconds of a wild motion that the IMU does not see: the attitude may be anywhere. What the scans show
// brings roll, pitch and velocity back at once, where the linear covariance would have had them rejected.
TEST(LostTilt, IsFoundAgainWithinASecondOfAnImuGap) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    SimulatedRun run("difficult", seed, 30.0, 5.0);
    const Time gap = run.setup.start + 20.0;
    run.run([&](simulation::SensorData& data) {
      auto& samples = data.imu.samples;
      samples.erase(std::remove_if(samples.begin(), samples.end(),
                                   [&](const auto& imu) { return gap < imu.time && imu.time < gap + 2.0; }),
                    samples.end());
    });
    EXPECT_LT(run.rms(23.0, 26.0, [&](const auto& state) { return run.tiltError(state); }), 0.03) << seed;
    EXPECT_LT(run.rms(23.0, 26.0, [&](const auto& state) { return run.velocityError(state); }), 0.2) << seed;
  }
}

}  // namespace
}  // namespace rio_t
