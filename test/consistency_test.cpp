// What is published as sigma is what the errors are: the whole pipeline on simulated sensors, over seeds.
// `scripts/experiment.sh consistency` prints the same for more motions and longer runs.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rio_t/core/so3.h"
#include "simulated_run.h"

namespace rio_t {
namespace {

constexpr double kStart = 5.0;  // [s] of rest
constexpr double kFrom = 10.0;  // [s] the noise has been measured for three seconds of motion
constexpr int kSeeds = 6;

/// Mean squares of errors in sigmas, per degree of freedom: 1 where the sigmas are right.
struct Nees {
  double position = 0.0, velocity = 0.0, tilt = 0.0, time_offset = 0.0;
  double position_square = 0.0;  ///< [m^2] mean square error
};

/// Of one run, over the states at the times of the scans. W is that of the estimate: its origin and heading
/// are the truth's at the start, where all these motions begin level with the axes of W.
Nees neesOf(const SimulatedRun& run) {
  Nees sum;
  double count = 0.0;
  for (const ScanResult& result : run.results) {
    if (!result.updated || run.seconds(result.state.time) < kFrom) continue;
    const NavigationState& x = result.state;
    const simulation::MotionState truth = run.truth(x);
    const Eigen::Quaterniond turn = run.turnIntoW();
    const Eigen::Vector3d e_p = run.wayError(x);
    const Eigen::Vector3d e_v = x.v_W - turn * truth.v_W;
    const Eigen::Matrix3d R_WI = x.q_WI.toRotationMatrix();
    const Eigen::Vector3d e_R = so3::log(x.q_WI * (turn * truth.q_WI).conjugate());
    const Eigen::Matrix3d P_R = R_WI * x.covariance.block<3, 3>(0, 0) * R_WI.transpose();
    sum.position_square += e_p.squaredNorm();
    for (int i = 0; i < 3; ++i) {
      sum.position += e_p[i] * e_p[i] / x.covariance(StateBlock::kP + i, StateBlock::kP + i) / 3.0;
      sum.velocity += e_v[i] * e_v[i] / x.covariance(StateBlock::kV + i, StateBlock::kV + i) / 3.0;
      if (i < 2) sum.tilt += e_R[i] * e_R[i] / P_R(i, i) / 2.0;
    }
    const double e_t = result.time_offset - run.setup.time_offset.constant;
    sum.time_offset += e_t * e_t / (result.time_offset_sigma * result.time_offset_sigma);
    count += 1.0;
  }
  return {sum.position / count, sum.velocity / count, sum.tilt / count, sum.time_offset / count,
          sum.position_square / count};
}

/// An IMU of 100 Hz whose driver loses every third sample: the spacing is 10 ms or 20 ms.
void loseEveryThird(simulation::SensorData& data) {
  std::vector<ImuMeasurement> kept;
  for (std::size_t i = 0; i < data.imu.samples.size(); ++i)
    if (i % 3 != 2) kept.push_back(data.imu.samples[i]);
  data.imu.samples = kept;
}

/// `position_error` [m] bounds the root mean square over the runs: sigmas twice as large as they could be are
/// consistent, too. The bounds below are 1.5 times what was measured: other draws of the noise may differ by
/// a quarter, and a change that doubles the error must fail.
void expectConsistent(const std::string& motion, double position_error, double vibration,
                      bool loses_samples = false) {
  Nees mean;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SimulatedRun run(motion, seed, 45.0, kStart);
    run.setup.time_offset.constant = 0.03;
    run.setup.imu.accel_vibration = vibration;
    if (loses_samples) run.setup.imu.rate = 100.0;
    run.run(loses_samples ? loseEveryThird : nullptr);
    const Nees nees = neesOf(run);
    mean.position += nees.position / kSeeds;
    mean.velocity += nees.velocity / kSeeds;
    mean.tilt += nees.tilt / kSeeds;
    mean.time_offset += nees.time_offset / kSeeds;
    mean.position_square += nees.position_square / kSeeds;
  }
  std::printf("%s, vibration %.1f: position %.2f, velocity %.2f, tilt %.2f, offset %.2f; %.4f m\n",
              motion.c_str(), vibration, mean.position, mean.velocity, mean.tilt, mean.time_offset,
              std::sqrt(mean.position_square));
  EXPECT_LT(std::sqrt(mean.position_square), position_error);
  for (const double nees : {mean.position, mean.velocity, mean.tilt}) {
    EXPECT_GT(nees, 0.5);
    EXPECT_LT(nees, 2.0);
  }
  // A run is about one sample of it: six of them scatter by 0.6.
  EXPECT_GT(mean.time_offset, 0.2);
  EXPECT_LT(mean.time_offset, 2.8);
}

double heading(const Eigen::Quaterniond& q_WI) {
  const Eigen::Vector3d forward = q_WI * Eigen::Vector3d::UnitX();
  return std::atan2(forward.y(), forward.x());
}

/// A start in motion knows the gyro bias to 0.01 rad/s. The heading drifts, and no sensor observes it. The
/// linear prior must not claim to know it.
TEST(Consistency, HeadingOfAVehicleThatStartsInMotion) {
  double mean = 0.0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SimulatedRun run("ground_vehicle", seed, 60.0, 0.0);
    run.options.init_mode = InitMode::kMotion;
    run.run();
    std::optional<double> drift_at_start;
    double sum = 0.0, count = 0.0;
    for (const ScanResult& result : run.results) {
      if (!result.updated) continue;
      const NavigationState& x = result.state;
      const double drift = heading(x.q_WI) - heading(run.truth(x).q_WI);
      if (!drift_at_start) drift_at_start = drift;
      const double error = std::remainder(drift - *drift_at_start, 2.0 * M_PI);
      const Eigen::Vector3d z_I = x.q_WI.conjugate() * Eigen::Vector3d::UnitZ();
      sum += error * error / z_I.dot(x.covariance.topLeftCorner<3, 3>() * z_I);
      count += 1.0;
    }
    ASSERT_GT(count, 400.0);
    mean += sum / count / kSeeds;
  }
  std::printf("start in motion: heading %.2f\n", mean);
  EXPECT_LT(mean, 2.0);
}

/// A precise and fast radar beside an IMU that vibrates: the estimated velocity follows the radar, and the
/// offset shows only where the acceleration changes.
TEST(Consistency, OffsetOfAFastRadarBesideAnImuThatVibrates) {
  double mean = 0.0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SimulatedRun run("easy", seed, 45.0, kStart);
    run.setup.time_offset.constant = 0.03;
    run.setup.imu.rate = 100.0;
    run.setup.imu.accel_vibration = 0.3;
    run.setup.radar.rate = 50.0;
    run.setup.radar.doppler_step = 0.0;
    run.run();
    mean += neesOf(run).time_offset / kSeeds;
  }
  std::printf("fast radar, vibration: offset %.2f\n", mean);
  EXPECT_LT(mean, 2.8);
}

/// A gyro that reads some tenths of a percent too much, as most do, on a motion that turns fast.
TEST(Consistency, AGyroWithAWrongScaleIsInTheSigma) {
  Nees mean;
  std::uint64_t steps = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SimulatedRun run("drone", seed, 45.0, kStart);
    run.setup.time_offset.constant = 0.03;
    run.setup.radar.rate = 25.0;
    run.setup.imu.noise.gyro_scale_error = run.options.imu_noise.gyro_scale_error = 0.005;
    run.run();
    const Nees nees = neesOf(run);
    mean.velocity += nees.velocity / kSeeds;
    mean.tilt += nees.tilt / kSeeds;
    steps += run.odometry->faults()["time_offset_step"];
  }
  std::printf("wrong scale of the gyro: velocity %.2f, tilt %.2f, steps %d\n", mean.velocity, mean.tilt,
              static_cast<int>(steps));
  EXPECT_LT(mean.velocity, 2.0);
  EXPECT_LT(mean.tilt, 2.0);
  EXPECT_EQ(steps, 0U);
}

/// A radar half a metre from the IMU, of which the odometry is not told.
TEST(Consistency, ALeverArmThatNobodyMeasured) {
  Nees mean;
  double lever_arm = 0.0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SimulatedRun run("walk", seed, 60.0, kStart);
    run.setup.time_offset.constant = 0.03;
    run.setup.T_IR.l_I = {0.3, 0.1, 0.4};
    run.options.radar.T_IR.l_I.setZero();
    run.options.smoother.estimate_extrinsics = EstimateExtrinsics::kLeverArm;
    run.options.radar.extrinsics_translation_sigma = 0.5;
    run.run();
    const Nees nees = neesOf(run);
    mean.velocity += nees.velocity / kSeeds;
    mean.time_offset += nees.time_offset / kSeeds;
    const ScanResult& last = run.results.back();
    const Eigen::Vector3d error = last.T_IR.l_I - run.setup.T_IR.l_I;
    const Eigen::Matrix3d P = last.T_IR_covariance.topLeftCorner<3, 3>();
    EXPECT_LT(P.diagonal().maxCoeff(), 0.02 * 0.02);
    lever_arm += error.dot(P.ldlt().solve(error)) / 3.0 / kSeeds;
  }
  std::printf("unknown lever arm: velocity %.2f, offset %.2f, lever arm %.2f\n", mean.velocity,
              mean.time_offset, lever_arm);
  EXPECT_LT(mean.velocity, 2.0);
  EXPECT_LT(mean.time_offset, 2.0);
  EXPECT_LT(lever_arm, 2.0);
}

/// It never turns. The noise of the gyro must not look like turns that show the lever arm.
TEST(Consistency, AStraightDriveDoesNotShowTheLeverArm) {
  SimulatedRun run("constant_speed", 1, 120.0, kStart);
  run.setup.imu.noise.gyro_density = 0.001;
  run.setup.radar.rate = 20.0;
  run.options.radar.T_IR.l_I.setZero();
  run.options.smoother.estimate_extrinsics = EstimateExtrinsics::kLeverArm;
  run.options.radar.extrinsics_translation_sigma = 0.5;
  run.run();
  const Eigen::Vector3d sigma = run.results.back().T_IR_covariance.diagonal().head<3>().cwiseSqrt();
  EXPECT_GT(sigma.minCoeff(), 0.45) << sigma.transpose();
}

TEST(Consistency, Medium) { expectConsistent("medium", 0.085, 0.0); }
TEST(Consistency, Drone) { expectConsistent("drone", 0.13, 0.0); }
TEST(Consistency, GroundVehicle) { expectConsistent("ground_vehicle", 0.32, 0.0); }
TEST(Consistency, GroundVehicleThatVibrates) { expectConsistent("ground_vehicle", 0.34, 0.8); }
TEST(Consistency, VibrationThoughSamplesAreMissing) { expectConsistent("ground_vehicle", 0.42, 0.8, true); }

}  // namespace
}  // namespace rio_t
