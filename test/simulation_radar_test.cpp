// Scans of the simulated radar: the velocity they show, when they come, and what is refused.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <vector>

#include "rio_t/simulation/radar_model.h"
#include "simulation_setup.h"

namespace rio_t::simulation {
namespace {

void expectExactEgoVelocity(const Motion& motion, const SimulationOptions& options) {
  expectExactEgoVelocity(motion, simulate(motion, options).scans, options, options.start);
}

TEST(RadarModel, NoiseFreeEgoVelocityIsTheTrueOneAtTheMeasurementTime) {
  SimulationOptions options = withoutErrors();
  for (const double offset : {0.0, -0.00925, 0.1}) {
    options.time_offset.constant = offset;
    expectExactEgoVelocity(builtIn("difficult"), options);
  }
}

TEST(RadarModel, NoiseFreeEgoVelocityIsTheTrueOneWithAnotherMounting) {
  SimulationOptions options = withoutErrors();
  options.T_IR.l_I = {0.5, -0.2, 0.3};
  options.T_IR.q_IR = Eigen::Quaterniond(0.8, -0.3, 0.4, 0.1).normalized();
  options.time_offset.constant = 0.03;
  expectExactEgoVelocity(builtIn("difficult", 2), options);
}

TEST(RadarModel, FollowsADriftingAndSteppingOffset) {
  SimulationOptions options = withoutErrors();
  options.time_offset.constant = 0.01;
  options.time_offset.drift = 2e-4;
  options.time_offset.steps = {{40.0, 0.03}, {60.0, -0.05}};
  EXPECT_NEAR(options.time_offset.at(39.9), 0.01 + 39.9 * 2e-4, 1e-12);
  EXPECT_NEAR(options.time_offset.at(40.0), 0.04 + 40.0 * 2e-4, 1e-12);
  EXPECT_NEAR(options.time_offset.at(60.0), -0.01 + 60.0 * 2e-4, 1e-12);
  expectExactEgoVelocity(builtIn("difficult"), options);
}

TEST(RadarModel, LeavesOutScansThatWouldHaveBeenMeasuredBeforeTheMotion) {
  SimulationOptions options = withoutErrors();
  options.time_offset.constant = 0.2;
  const SensorData data = simulate(builtIn("start_in_motion", 1, 30.0), options);
  ASSERT_FALSE(data.scans.empty());
  EXPECT_EQ(data.scans.front().seq, 0u);
  EXPECT_GE(data.scans.front().measured, options.start);
  EXPECT_NEAR(data.scans.front().stamp - options.start, 0.25, 1e-9);
}

TEST(RadarModel, FrameLengthAveragesTheDoppler) {
  const Motion motion = builtIn("difficult");
  SimulationOptions options = withoutErrors();
  const SensorData instant = simulate(motion, options);
  options.radar.frame_length = 0.2;
  const SensorData averaged = simulate(motion, options);
  double largest = 0.0;
  for (std::size_t k = 0; k < averaged.scans.size(); ++k) {
    const double t = averaged.scans[k].measured - options.start;
    if (t < 0.1 || t > motion.duration() - 0.1) continue;
    // The mean range rate is the change of range over the frame: needs no velocities at all. The points are
    // exact, so their place in W is known.
    const SimulatedPoint& point = averaged.scans[k].points.front();
    const auto radarAt = [&](double time) -> Eigen::Vector3d {
      const MotionState s = motion.at(time);
      return s.p_W + s.q_WI * options.T_IR.l_I;
    };
    const Eigen::Vector3d p_W = radarAt(t) + motion.at(t).q_WI * (options.T_IR.q_IR * point.position_R);
    const double mean = ((p_W - radarAt(t + 0.1)).norm() - (p_W - radarAt(t - 0.1)).norm()) / 0.2;
    ASSERT_NEAR(point.doppler, mean, 2e-4) << t;
    largest = std::max(largest, std::abs(point.doppler - instant.scans[k].points.front().doppler));
  }
  EXPECT_GT(largest, 0.02);  // the frame does matter in this motion
}

TEST(RadarModel, TheFirstTriggerSetsThePhase) {
  SimulationOptions options;
  options.radar.rate = 20.0;
  options.radar.first_trigger = 0.07;
  const std::vector<SimulatedScan> scans = simulate(builtIn("easy", 1, 30.0), options).scans;
  EXPECT_NEAR(scans[0].stamp - options.start, 0.07, 1e-9);
  EXPECT_NEAR(scans[100].stamp - options.start, 5.07, 1e-9);
}

TEST(RadarModel, ScansArriveWithTheLatency) {
  SimulationOptions options;
  options.radar.latency = 0.1;
  for (const SimulatedScan& scan : simulate(builtIn("easy", 1, 30.0), options).scans) {
    EXPECT_NEAR(scan.arrival - scan.stamp, 0.1, 1e-9);
  }
  options.radar.latency_sigma = 0.01;
  double square = 0.0, count = 0.0;
  for (const SimulatedScan& scan : simulate(builtIn("easy"), options).scans) {
    square += std::pow(scan.arrival - scan.stamp - 0.1, 2);
    count += 1.0;
  }
  EXPECT_NEAR(std::sqrt(square / count), 0.01, 5.0 * 0.01 / std::sqrt(2.0 * count));
}

TEST(RadarModel, RefusesOptionsOutOfRange) {
  const Motion motion = builtIn("easy", 1, 30.0);
  SimulationOptions options;
  options.radar.ghost_share = 1.5;
  EXPECT_THROW(simulate(motion, options), std::invalid_argument);
  options = SimulationOptions{};
  options.radar.rate = 0.0;
  EXPECT_THROW(simulate(motion, options), std::invalid_argument);
  options = SimulationOptions{};
  options.radar.first_trigger = -0.01;
  EXPECT_THROW(simulate(motion, options), std::invalid_argument);
  options = SimulationOptions{};
  options.imu.rate = -1.0;
  EXPECT_THROW(simulate(motion, options), std::invalid_argument);
}

}  // namespace
}  // namespace rio_t::simulation
