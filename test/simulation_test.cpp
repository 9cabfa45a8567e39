#include "rio_t/simulation/simulation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "rio_t/simulation/presets.h"
#include "simulation_setup.h"

namespace rio_t::simulation {
namespace {

double spread(const std::vector<double>& values) {
  double mean = 0.0, square = 0.0;
  for (const double v : values) mean += v / static_cast<double>(values.size());
  for (const double v : values) square += (v - mean) * (v - mean) / static_cast<double>(values.size());
  return std::sqrt(square);
}

TEST(Presets, AKartHasASparseCoarseRadarAndAnImuThatShakes) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    Preset kart = presetOf("kart");
    kart.options.seed = seed;
    const Motion motion = makeMotion({kart.motion, seed, kart.duration, kart.rest});
    const SensorData data = simulate(motion, kart.options);

    double length = 0.0;
    for (double t = 0.0; t < motion.duration(); t += 0.01) {
      const MotionState state = motion.at(t);
      length += 0.01 * state.v_W.norm();
      ASSERT_LT(std::abs(state.p_W.z()), 1e-6) << t;
      if (t < 2.0) {
        ASSERT_EQ(state.v_W.norm(), 0.0) << t;
      }
    }
    EXPECT_GT(motion.at(3.5).v_W.norm(), 0.5);
    EXPECT_NEAR(length, 120.0, 10.0);

    const std::vector<int> counts = sortedCounts(data.scans);
    EXPECT_EQ(counts[counts.size() / 10], 3);
    EXPECT_EQ(counts[counts.size() / 2], 6);
    EXPECT_EQ(counts[counts.size() * 9 / 10], 10);
    EXPECT_EQ(counts.front(), 1);                 // empty ones are not published
    EXPECT_LT(counts.size(), data.scans.size());  // and there are some
    EXPECT_NEAR(static_cast<double>(data.scans.size()) / motion.duration(), 30.0, 0.1);

    std::vector<double> ranges, azimuths, elevations;
    double misfits = 0.0;
    for (const SimulatedScan& scan : data.scans) {
      for (const SimulatedPoint& point : scan.points) {
        const Eigen::Vector3d& p_R = point.position_R;
        ASSERT_EQ(point.doppler, 0.49 * std::round(point.doppler / 0.49));
        ranges.push_back(p_R.norm());
        azimuths.push_back(std::atan2(p_R.x(), p_R.y()) * 180.0 / 3.141592653589793);
        elevations.push_back(std::asin(p_R.z() / p_R.norm()) * 180.0 / 3.141592653589793);
        // Two steps are far beyond half a step and what the angles' noise makes of 3 m/s.
        misfits += std::abs(point.doppler + p_R.normalized().dot(scan.v_R)) > 0.98 ? 1.0 : 0.0;
      }
    }
    std::nth_element(ranges.begin(), ranges.begin() + static_cast<std::ptrdiff_t>(ranges.size() / 2),
                     ranges.end());
    EXPECT_NEAR(ranges[ranges.size() / 2], 2.9, 0.15);
    EXPECT_NEAR(spread(azimuths), 31.0, 1.5);
    EXPECT_NEAR(spread(elevations), 35.0, 1.5);
    EXPECT_GT(misfits / static_cast<double>(ranges.size()), 0.01);
    EXPECT_LT(misfits / static_cast<double>(ranges.size()), 0.05);

    // Looks to the left and upwards, its right side level.
    const Eigen::Vector3d forward_I = kart.options.T_IR.q_IR * Eigen::Vector3d::UnitY();
    EXPECT_NEAR(std::atan2(forward_I.y(), forward_I.x()), 0.5236, 1e-4);
    EXPECT_NEAR(std::asin(forward_I.z()), 0.3840, 1e-4);
    EXPECT_NEAR((kart.options.T_IR.q_IR * Eigen::Vector3d::UnitX()).z(), 0.0, 1e-9);

    std::vector<double> at_rest;
    for (std::size_t i = 0; i < 200; ++i) at_rest.push_back(data.imu.samples[i].acceleration.x());
    EXPECT_NEAR(spread(at_rest), 0.8, 5.0 * 0.8 / std::sqrt(2.0 * 200.0));
    EXPECT_EQ(data.imu.samples[100].time - kart.options.start, 1.0);
  }
}

TEST(Presets, AKartPairIsTheKartWithARadarToEitherSide) {
  const Preset kart = presetOf("kart");
  const Preset pair = presetOf("kart_pair");
  EXPECT_EQ(pair.motion, kart.motion);
  EXPECT_EQ(pair.options.imu.accel_vibration, kart.options.imu.accel_vibration);
  ASSERT_EQ(pair.options.radars.size(), 2u);
  const RadarSetup& left = pair.options.radars.at("left");
  const RadarSetup& right = pair.options.radars.at("right");
  EXPECT_EQ(left.T_IR.l_I, Eigen::Vector3d(1.0, 0.3, 0.0));
  EXPECT_EQ(right.T_IR.l_I, Eigen::Vector3d(1.0, -0.3, 0.0));
  for (const auto& [radar, side] : {std::pair(left, 1.0), std::pair(right, -1.0)}) {
    const Eigen::Vector3d forward_I = radar.T_IR.q_IR * Eigen::Vector3d::UnitY();
    EXPECT_NEAR(std::atan2(forward_I.y(), forward_I.x()), side * 0.5236, 1e-4);
    EXPECT_NEAR(std::asin(forward_I.z()), 0.3840, 1e-4);
    EXPECT_NEAR((radar.T_IR.q_IR * Eigen::Vector3d::UnitX()).z(), 0.0, 1e-9);
  }
  const Motion motion = makeMotion({pair.motion, 1, 40.0, pair.rest});
  const SensorData data = simulate(motion, pair.options);
  EXPECT_TRUE(data.scans.empty());
  for (const auto& [name, scans] : data.radars) {
    const std::vector<int> counts = sortedCounts(scans);
    EXPECT_EQ(counts[counts.size() / 2], 6) << name;
    EXPECT_NEAR(static_cast<double>(scans.size()) / motion.duration(), 30.0, 0.1) << name;
    for (const SimulatedScan& scan : scans) {
      for (const SimulatedPoint& point : scan.points)
        ASSERT_EQ(point.doppler, 0.49 * std::round(point.doppler / 0.49));
    }
  }
  // Same rate, and always a good part of the period apart.
  const auto& a = data.radars.at("left");
  const auto& b = data.radars.at("right");
  for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k)
    ASSERT_NEAR(b[k].stamp - a[k].stamp, 0.012, 1e-6);
}

TEST(Presets, AreKnownByName) {
  for (const Preset& preset : presets()) EXPECT_EQ(presetOf(preset.name).motion, preset.motion);
  try {
    presetOf("tank");
    FAIL() << "no exception";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("kart"), std::string::npos) << error.what();
  }
}

TEST(Simulation, SameSeedSameDataOtherSeedOtherData) {
  const Motion motion = builtIn("medium", 1, 30.0);
  SimulationOptions options;
  options.seed = 11;
  const SensorData a = simulate(motion, options);
  const SensorData b = simulate(motion, options);
  options.seed = 12;
  const SensorData c = simulate(motion, options);
  ASSERT_EQ(a.imu.samples.size(), b.imu.samples.size());
  bool imu_differs = false;
  for (std::size_t i = 0; i < a.imu.samples.size(); ++i) {
    ASSERT_EQ(a.imu.samples[i].acceleration, b.imu.samples[i].acceleration);
    ASSERT_EQ(a.imu.samples[i].angular_velocity, b.imu.samples[i].angular_velocity);
    imu_differs = imu_differs || a.imu.samples[i].acceleration != c.imu.samples[i].acceleration;
  }
  EXPECT_TRUE(imu_differs);
  bool radar_differs = false;
  for (std::size_t k = 0; k < a.scans.size(); ++k) {
    ASSERT_EQ(a.scans[k].points.size(), b.scans[k].points.size());
    radar_differs = radar_differs || a.scans[k].points.size() != c.scans[k].points.size();
    for (std::size_t i = 0; i < a.scans[k].points.size(); ++i) {
      ASSERT_EQ(a.scans[k].points[i].position_R, b.scans[k].points[i].position_R);
      ASSERT_EQ(a.scans[k].points[i].doppler, b.scans[k].points[i].doppler);
    }
  }
  EXPECT_TRUE(radar_differs);
}

TEST(Simulation, TheOffsetLeavesTheImuAlone) {
  const Motion motion = builtIn("medium", 1, 30.0);
  SimulationOptions options;
  const SensorData without = simulate(motion, options);
  options.time_offset.constant = 0.1;
  const SensorData with = simulate(motion, options);
  EXPECT_EQ(without.imu.samples.back().acceleration, with.imu.samples.back().acceleration);
}

// --- Several radars

bool same(const std::vector<SimulatedScan>& a, const std::vector<SimulatedScan>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const SimulatedScan& x, const SimulatedScan& y) {
                      return x.stamp == y.stamp && x.arrival == y.arrival && x.delivered == y.delivered &&
                             std::equal(x.points.begin(), x.points.end(), y.points.begin(), y.points.end(),
                                        [](const SimulatedPoint& p, const SimulatedPoint& q) {
                                          return p.position_R == q.position_R && p.doppler == q.doppler &&
                                                 p.snr_db == q.snr_db && p.noise_db == q.noise_db;
                                        });
                    });
}

TEST(SeveralRadars, EachShowsItsOwnOffsetAndMounting) {
  const Motion motion = builtIn("difficult");
  SimulationOptions options = withoutErrors();
  const RadarSetup& exact = options;
  RadarSetup left = exact, right = exact;
  left.time_offset.constant = -0.009;
  left.T_IR.l_I = {0.1, 0.2, 0.0};
  left.radar.rate = 12.0;
  right.time_offset.constant = 0.04;
  right.time_offset.steps = {{40.0, 0.03}};
  right.T_IR.q_IR = Eigen::Quaterniond(0.8, -0.3, 0.4, 0.1).normalized();
  options.radars = {{"left", left}, {"right", right}};
  const SensorData data = simulate(motion, options);
  EXPECT_TRUE(data.scans.empty());
  ASSERT_EQ(data.radars.size(), 2u);
  expectExactEgoVelocity(motion, data.radars.at("left"), left, options.start);
  expectExactEgoVelocity(motion, data.radars.at("right"), right, options.start);
  EXPECT_EQ(data.radars.at("left").size(), 1080u);
  EXPECT_NEAR(static_cast<double>(data.radars.at("right").size()), 900.0, 1.0);
}

TEST(SeveralRadars, WhatOneMeasuresDoesNotDependOnTheOthers) {
  const Motion motion = builtIn("medium", 1, 30.0);
  SimulationOptions options;
  options.seed = 3;
  RadarSetup lossy;
  lossy.radar.dropout_share = 0.3;
  lossy.radar.latency_sigma = 0.01;
  options.radars = {{"left", lossy}};
  const std::vector<SimulatedScan> alone = simulate(motion, options).radars.at("left");
  RadarSetup crowded;
  crowded.radar.crowd = 4;
  options.radars["front"] = crowded;
  options.radars["right"] = lossy;
  const SensorData all = simulate(motion, options);
  EXPECT_TRUE(same(all.radars.at("left"), alone));
  // The same setup under another name draws other numbers, and so does another seed.
  EXPECT_FALSE(same(all.radars.at("left"), all.radars.at("right")));
  std::size_t lost_apart = 0;
  for (std::size_t k = 0; k < alone.size(); ++k)
    lost_apart += all.radars.at("right")[k].delivered != alone[k].delivered ? 1 : 0;
  EXPECT_GT(lost_apart, 60u);  // 0.42 of 300 where the losses are independent
  options.seed = 4;
  EXPECT_FALSE(same(simulate(motion, options).radars.at("left"), alone));
}

TEST(SeveralRadars, LeaveTheImuAlone) {
  const Motion motion = builtIn("medium", 1, 30.0);
  SimulationOptions options;
  options.seed = 5;
  const ImuData without = simulate(motion, options).imu;
  options.radars = {{"left", RadarSetup{}}, {"right", RadarSetup{}}};
  const ImuData with = simulate(motion, options).imu;
  ASSERT_EQ(with.samples.size(), without.samples.size());
  for (std::size_t i = 0; i < with.samples.size(); ++i) {
    ASSERT_EQ(with.samples[i].acceleration, without.samples[i].acceleration) << i;
    ASSERT_EQ(with.samples[i].angular_velocity, without.samples[i].angular_velocity) << i;
    ASSERT_EQ(with.b_a[i], without.b_a[i]) << i;
    ASSERT_EQ(with.b_g[i], without.b_g[i]) << i;
  }
}

TEST(SeveralRadars, ABadOneIsNamed) {
  const Motion motion = builtIn("easy", 1, 30.0);
  for (const std::string name : {"", "Left", "left-1", "left/a", "lëft"}) {
    SimulationOptions options;
    options.radars = {{name, RadarSetup{}}};
    EXPECT_THROW(simulate(motion, options), std::invalid_argument) << name;
  }
  SimulationOptions options;
  options.radars = {{"left", RadarSetup{}}, {"right_2", RadarSetup{}}};
  EXPECT_NO_THROW(simulate(motion, options));
  options.radars["right_2"].radar.rate = 0.0;
  try {
    simulate(motion, options);
    FAIL() << "no exception";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("'right_2'"), std::string::npos) << error.what();
  }
}

TEST(Simulation, GroundTruthIsTheMotion) {
  const Motion motion = builtIn("drone", 1, 30.0);
  const Time start = Time::fromNanoseconds(1'700'000'000'000'000'000);
  const Trajectory truth = groundTruth(motion, 400.0, start);
  ASSERT_EQ(truth.size(), 12001u);
  EXPECT_EQ(truth[8000].time - start, 20.0);
  EXPECT_EQ(truth[8000].p_W, motion.at(20.0).p_W);
  EXPECT_EQ(truth[8000].q_WI.coeffs(), motion.at(20.0).q_WI.coeffs());
}

}  // namespace
}  // namespace rio_t::simulation
