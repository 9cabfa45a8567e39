// The constraint of a vehicle on wheels: the factor, and its effect in the whole pipeline.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "batch_of.h"
#include "numeric_jacobian.h"
#include "rio_t/core/so3.h"
#include "rio_t/factors/ground_vehicle_factor.h"
#include "rio_t/imu/rest_detector.h"
#include "rio_t/simulation/presets.h"
#include "simulated_run.h"
#include "synthetic_motion.h"

namespace rio_t {
namespace {

std::vector<double> values(const Eigen::VectorXd& x) { return {x.data(), x.data() + x.size()}; }

TEST(GroundVehicleFactor, JacobiansAreCorrect) {
  const StateBlock x = SyntheticMotion().state(1.3);
  const Extrinsics T_IV{{-0.8, 0.1, -0.3}, Eigen::Quaterniond(so3::exp({0.1, -0.3, 0.7}))};
  expectJacobiansCorrect(GroundVehicleFactor({0.1, -0.2, 0.9}, {0.05, 0.08}),
                         {motionOf(x), biasesOf(x), values(stored(T_IV))});
  expectJacobiansCorrect(LevelGroundFactor(0.01), {motionOf(x), values(stored(T_IV))});
}

TEST(GroundVehicleFactor, ATurnAboutTheRearAxleHasNoResidual) {
  // The IMU sits 1.2 m before the axle and turned to the left by 0.4 rad.
  const Extrinsics T_IV{Eigen::Quaterniond(so3::exp({0.0, 0.0, -0.4})) * Eigen::Vector3d(-1.2, 0.0, 0.0),
                        Eigen::Quaterniond(so3::exp({0.0, 0.0, -0.4}))};
  const Eigen::Vector3d omega(0.0, 0.0, 0.8), forward_V(3.0, 0.0, 0.0);
  StateBlock x;
  x.q_WI() = so3::exp({0.05, 0.1, 1.0});
  x.v_W() = x.q_WI() * (T_IV.q_IR * forward_V - omega.cross(T_IV.l_I));
  const Eigen::VectorXd frame = stored(T_IV);
  const double* const blocks[] = {x.data(), x.biases(), frame.data()};
  Eigen::Vector2d residual;
  ASSERT_TRUE(GroundVehicleFactor(omega, {0.05, 0.05}).Evaluate(blocks, residual.data(), nullptr));
  EXPECT_LT(residual.norm(), 1e-12);
  // About the IMU itself it has.
  Eigen::VectorXd wrong = stored({Eigen::Vector3d::Zero(), T_IV.q_IR});
  const double* const about_imu[] = {x.data(), x.biases(), wrong.data()};
  ASSERT_TRUE(GroundVehicleFactor(omega, {0.05, 0.05}).Evaluate(about_imu, residual.data(), nullptr));
  EXPECT_NEAR(std::abs(residual[0]), 1.2 * 0.8 / 0.05, 1e-9);
}

struct VehicleRun : SimulatedRun {
  VehicleRun(const std::string& name, std::uint64_t seed, double duration, bool constrained)
      : SimulatedRun(name, seed, duration, 3.0) {
    if (constrained) options.platform = Platform::kGroundVehicle;
  }
  void takeKart() {
    const std::uint64_t seed = setup.seed;
    setup = simulation::presetOf("kart").options;
    setup.seed = seed;
    options.radar.T_IR = setup.T_IR;
    // The vehicle tells how the radar is tilted, and not the other way round.
    options.smoother.estimate_extrinsics = EstimateExtrinsics::kRotation;
  }
  double heightRms() const {
    return rms(4.0, 1e3, [this](const NavigationState& state) { return state.p_W.z(); });
  }
  /// Seconds of the run when the motion contradicted the platform.
  std::optional<double> contradictedAt() const {
    for (const ScanResult& result : results)
      if (result.ground_vehicle && result.ground_vehicle->is_contradicted) return seconds(result.scan.stamp);
    return std::nullopt;
  }
};

TEST(GroundVehicle, AKartKeepsItsHeight) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    VehicleRun with("kart", seed, 90.0, true);
    with.takeKart();
    with.run();
    EXPECT_LT(with.heightRms(), 0.15) << seed;
    EXPECT_FALSE(with.contradictedAt()) << seed;
  }
}

TEST(GroundVehicle, TheBatchKnowsThatTheKartStaysOnTheGround) {
  const auto heightRms = [](bool constrained) {
    VehicleRun run("kart", 4, 60.0, constrained);
    run.takeKart();
    run.run();
    const BatchResult batch = batchOf(run);
    EXPECT_TRUE(batch.solution.converged());
    EXPECT_EQ(batch.solution.T_IV.has_value(), constrained);
    run.states = batch.trajectory;
    return run.heightRms();
  };
  const double with = heightRms(true);
  EXPECT_LT(with, 0.15);
  EXPECT_LT(with, 0.5 * heightRms(false));
}

TEST(GroundVehicle, TheBatchOfADroneIsFree) {
  VehicleRun run("drone", 1, 40.0, true);
  run.run();
  ASSERT_TRUE(run.contradictedAt());
  EXPECT_FALSE(batchOf(run).solution.T_IV);
}

TEST(GroundVehicle, ADroneIsToldWithinTenSecondsAndNotHarmed) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    VehicleRun with("drone", seed, 60.0, true), without("drone", seed, 60.0, false);
    with.run();
    without.run();
    ASSERT_TRUE(with.contradictedAt()) << seed;
    EXPECT_LT(*with.contradictedAt(), 3.0 + 10.0) << seed;
    EXPECT_EQ(with.odometry->faults().at("ground_vehicle_contradicted"), 1u);
    const auto error = [](const VehicleRun& run) {
      return run.rms(20.0, 60.0, [&](const NavigationState& state) { return run.velocityError(state); });
    };
    EXPECT_LT(error(with), 1.2 * error(without)) << seed;
  }
}

// The platform is as before, but nobody knows for how long the clock was away.
TEST(GroundVehicle, IsJudgedAgainAfterAClockThatJumped) {
  VehicleRun run("drone", 1, 60.0, true);
  run.run([&](simulation::SensorData& data) {
    for (ImuMeasurement& sample : data.imu.samples)
      if (run.seconds(sample.time) > 30.0) sample.time = sample.time + 1000.0;
    for (simulation::SimulatedScan& scan : data.scans) {
      if (run.seconds(scan.stamp) < 30.0) continue;
      scan.stamp = scan.stamp + 1000.0;
      scan.arrival = scan.arrival + 1000.0;
    }
  });
  EXPECT_EQ(run.odometry->faults()["imu_clock_restart"], 1u);
  EXPECT_EQ(run.odometry->faults()["ground_vehicle_contradicted"], 2u);
}

/// After a blow to the IMU the estimate contradicts the vehicle. That is not the vehicle's fault.
TEST(GroundVehicle, IsJudgedAnewByANewEstimate) {
  VehicleRun run("ground_vehicle", 1, 80.0, true);
  run.run([&](simulation::SensorData& data) {
    for (ImuMeasurement& sample : data.imu.samples)
      if (run.seconds(sample.time) > 30.0 && run.seconds(sample.time) < 30.5) sample.acceleration.y() += 30.0;
  });
  EXPECT_EQ(run.odometry->faults()["ground_vehicle_contradicted"], 1u);
  EXPECT_EQ(run.odometry->faults()["reinitialized"], 1u);
  const auto used = std::count_if(run.results.begin(), run.results.end(), [&](const ScanResult& result) {
    return run.seconds(result.scan.stamp) > 50.0 && result.ground_vehicle && result.ground_vehicle->used;
  });
  EXPECT_GT(used, 100);
}

/// Turns the IMU, and with it the radar, against the vehicle: `q_VI` turns new vectors of I into old ones.
void mountTurned(const Eigen::Quaterniond& q_VI, simulation::SensorData& data, Extrinsics& T_IR) {
  const Eigen::Quaterniond q_IV = q_VI.conjugate();
  for (ImuMeasurement& sample : data.imu.samples) {
    sample.angular_velocity = q_IV * sample.angular_velocity;
    sample.acceleration = q_IV * sample.acceleration;
  }
  T_IR = {q_IV * T_IR.l_I, q_IV * T_IR.q_IR};
}

TEST(GroundVehicle, ItsFrameIsFoundAsWellAsItSays) {
  Eigen::Vector3d nees = Eigen::Vector3d::Zero();
  constexpr int kRuns = 6;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    VehicleRun run("ground_vehicle", seed, 60.0, true);
    const double side = seed % 2 == 0 ? 1.0 : -1.0;
    const Eigen::Quaterniond q_VI = so3::exp({0.0, side * 0.04, 0.05});
    Extrinsics turned = run.setup.T_IR;
    simulation::SensorData none;
    mountTurned(q_VI, none, turned);
    run.options.radar.T_IR = turned;
    run.options.ground_vehicle.rotation_sigma = 0.1;
    run.run([&](simulation::SensorData& data) {
      Extrinsics unused;
      mountTurned(q_VI, data, unused);
    });
    EXPECT_FALSE(run.contradictedAt());
    const GroundVehicleAnswer* last = nullptr;
    for (const ScanResult& result : run.results)
      if (result.ground_vehicle && result.updated) last = &*result.ground_vehicle;
    ASSERT_NE(last, nullptr);
    const Eigen::Vector3d error = so3::log(last->q_IV * q_VI);
    nees += error.cwiseQuotient(last->q_IV_sigma).cwiseAbs2() / kRuns;
    EXPECT_LT(std::abs(error.z()), 0.01);
    EXPECT_LT(std::abs(error.y()), 0.015);
  }
  std::printf("vehicle frame: roll %.2f, pitch %.2f, yaw %.2f\n", nees.x(), nees.y(), nees.z());
  for (const double axis : {nees.x(), nees.y(), nees.z()}) EXPECT_LT(axis, 2.5);
}

TEST(GroundVehicle, BumpsAndSlipAreLeftOut) {
  // A skid: the radar sees the vehicle move sideways at 1.5 m/s for a second, and the IMU feels it.
  VehicleRun run("ground_vehicle", 2, 45.0, true);
  run.run([&](simulation::SensorData& data) {
    for (ImuMeasurement& sample : data.imu.samples) {
      const double t = run.seconds(sample.time);
      if (t > 20.0 && t < 20.5) sample.acceleration.y() += 3.0;
      if (t > 21.0 && t < 21.5) sample.acceleration.y() -= 3.0;
    }
    for (simulation::SimulatedScan& scan : data.scans) {
      const double t = run.seconds(scan.measured);
      const double sideways = t < 20.0 || t > 21.5 ? 0.0 : 3.0 * std::min({t - 20.0, 0.5, 21.5 - t});
      const Eigen::Vector3d v_R = run.setup.T_IR.R_RI() * Eigen::Vector3d(0.0, sideways, 0.0);
      for (simulation::SimulatedPoint& point : scan.points)
        point.doppler -= point.position_R.normalized().dot(v_R);
    }
  });
  int left_out = 0, used_before = 0;
  for (const ScanResult& result : run.results) {
    if (!result.ground_vehicle) continue;
    const double t = run.seconds(result.scan.stamp);
    left_out += t > 20.2 && t < 21.3 && !result.ground_vehicle->used ? 1 : 0;
    used_before += t > 10.0 && t < 20.0 && result.ground_vehicle->used ? 1 : 0;
  }
  EXPECT_GE(left_out, 6);
  EXPECT_GT(used_before, 60);
  EXPECT_FALSE(run.contradictedAt());
}

TEST(GroundVehicle, AnEngineThatIdlesDoesNotHideRest) {
  VehicleRun run("ground_vehicle", 3, 40.0, true);
  simulation::MotionRequest request;
  request.name = "ground_vehicle";
  request.seed = 3;
  request.duration = 40.0;
  request.rest = {3.0, 8.0, 2.0};
  run.motion = simulation::makeMotion(request);
  run.setup.imu.accel_vibration = 0.8;
  run.setup.imu.gyro_vibration = 0.02;
  run.run();
  int used_moving = 0, used_at_rest = 0, judged_at_rest = 0;
  for (const ScanResult& result : run.results) {
    if (!result.ground_vehicle) continue;
    const double t = run.seconds(result.scan.stamp);
    used_moving += t > 10.0 && t < 28.0 && result.ground_vehicle->used ? 1 : 0;
    judged_at_rest += t > 34.0 ? 1 : 0;
    used_at_rest += t > 34.0 && result.ground_vehicle->used ? 1 : 0;
  }
  EXPECT_GT(used_moving, 120);
  EXPECT_GT(judged_at_rest, 30);  // to the IMU alone it is no rest
  EXPECT_EQ(used_at_rest, 0);     // with the radar it is, and rest takes the place of the constraint
  const double speed = run.rms(35.0, 40.0, [](const NavigationState& state) { return state.v_W.norm(); });
  EXPECT_LT(speed, 0.03);
}

TEST(Rest, AnImuThatShakesMayRestUnlessItsMeansSayOtherwise) {
  const auto buffer = [](double acceleration, double rate) {
    ImuBuffer imu;
    for (int i = 0; i <= 100; ++i) {
      ImuMeasurement sample;
      sample.time = Time::fromSeconds(0.01 * i);
      const double shake = i % 2 == 0 ? 1.0 : -1.0;
      sample.acceleration = {acceleration + 0.8 * shake, 0.8 * shake, 9.81 - 0.8 * shake};
      sample.angular_velocity = {0.0, 0.02 * shake, rate};
      imu.add(sample);
    }
    return imu;
  };
  RestContext context;
  context.g_W = {0.0, 0.0, -9.81};
  const Time now = Time::fromSeconds(1.0);
  const auto rest = findRest(buffer(0.0, 0.0), now, context, RestOptions());
  ASSERT_TRUE(rest);
  EXPECT_TRUE(rest->shakes);
  EXPECT_FALSE(findRest(buffer(1.5, 0.0), now, context, RestOptions()));
  EXPECT_FALSE(findRest(buffer(0.0, 0.1), now, context, RestOptions()));
  context.v_W = {0.3, 0.0, 0.0};
  EXPECT_FALSE(findRest(buffer(0.0, 0.0), now, context, RestOptions()));
}

}  // namespace
}  // namespace rio_t
