#include "rio_t/odometry/calibration_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "rio_t/core/angle.h"
#include "rio_t/core/so3.h"
#include "simulated_run.h"

namespace rio_t {
namespace {

using Eigen::Vector3d;

/// The errors of a radar, with axes that are those of I.
struct Errors {
  Vector3d turn;       // [rad]
  Vector3d lever_arm;  // [m]
  double scale;
  double offset;  // [s]
};

/// Filters the velocities of radars with such errors, without any noise. All that the check sees comes from
/// these errors.
CalibrationCheck checkOf(const std::vector<Errors>& radars) {
  constexpr double kSpacing = 0.01;  // [s] of the scans, short: they show the offset well
  const Eigen::Matrix3d P = Vector3d(1e-4, 2e-4, 4e-4).asDiagonal(),
                        R = Vector3d(3e-4, 2e-4, 1e-4).asDiagonal();
  CalibrationCheck check(radars.size());
  Vector3d v_W(1.0, 0.0, 0.2), estimate_W = v_W;
  for (int k = 0; k < 600; ++k) {
    const Vector3d change_W(0.02 * std::cos(0.05 * k), 0.02 * std::sin(0.03 * k), 0.01 * std::cos(0.07 * k));
    v_W += change_W;
    estimate_W += change_W;
    const std::size_t radar = static_cast<std::size_t>(k) % radars.size();
    const Errors& errors = radars[radar];
    UsedInnovation innovation;
    innovation.R_WR =
        so3::exp(Vector3d(0.3 * std::sin(0.2 * k), 0.3 * std::cos(0.13 * k), 0.02 * k)).toRotationMatrix();
    innovation.J_mean = -innovation.R_WR.transpose() * change_W / kSpacing;
    innovation.omega_R = Vector3d(std::cos(0.11 * k), std::sin(0.17 * k), std::cos(0.23 * k));
    innovation.v_R = so3::exp(-errors.turn) * (innovation.R_WR.transpose() * v_W) / (1.0 - errors.scale) +
                     innovation.omega_R.cross(errors.lever_arm) + innovation.J_mean * errors.offset;
    innovation.d = innovation.v_R - innovation.R_WR.transpose() * estimate_W;
    innovation.predicted = P;
    innovation.S = P + R;
    check.add(radar, innovation);
    estimate_W += innovation.R_WR * P * innovation.S.inverse() * innovation.d;
  }
  return check;
}

TEST(CalibrationCheck, IsExactForSmallErrorsWithoutNoise) {
  const std::vector<Errors> both = {{Vector3d(1e-4, -2e-4, 3e-4), Vector3d(-1e-4, 3e-4, 2e-4), 3e-4, -1e-4},
                                    {Vector3d(-2e-4, 1e-4, 2e-4), Vector3d(2e-4, 1e-4, -3e-4), -2e-4, 2e-4}};
  for (const std::size_t radars : {1U, 2U}) {
    const CalibrationCheck check = checkOf({both.begin(), both.begin() + radars});
    for (std::size_t k = 0; k < radars; ++k) {
      const CalibrationErrors found = check.errorsOf(k, {});
      EXPECT_LT((found.turn->error - both[k].turn).norm(), 1e-3 * both[k].turn.norm())
          << radars << " radars: " << found.turn->error.transpose();
      EXPECT_LT((found.lever_arm->error - both[k].lever_arm).norm(), 1e-3 * both[k].lever_arm.norm())
          << radars << " radars: " << found.lever_arm->error.transpose();
      EXPECT_NEAR(found.scale.error, both[k].scale, 1e-3 * std::abs(both[k].scale));
      EXPECT_NEAR(found.offset->error, both[k].offset, 1e-3 * std::abs(both[k].offset));
    }
  }
}

/// A run with Dopplers that are `factor` times the true ones.
SimulatedRun scaledBy(double factor, const std::string& motion, std::uint64_t seed,
                      EstimateExtrinsics estimate = EstimateExtrinsics::kNone) {
  SimulatedRun run(motion, seed, 50.0, 5.0);
  run.options.smoother.estimate_extrinsics = estimate;
  run.run([&](simulation::SensorData& data) {
    for (simulation::SimulatedScan& scan : data.scans)
      for (simulation::SimulatedPoint& point : scan.points) point.doppler *= factor;
  });
  return run;
}

/// A run with a mounting that is turned by `turn` from the told one, about the axes of I [rad].
SimulatedRun turnedBy(const Vector3d& turn, const std::string& motion, std::uint64_t seed) {
  SimulatedRun run(motion, seed, 50.0, 5.0);
  run.options.radar.T_IR.q_IR = so3::exp(-turn) * run.setup.T_IR.q_IR;
  run.run();
  return run;
}

/// A run of radars that are held at an offset that is `error` [s] short of the true one. The IMU vibrates by
/// `vibration` [m/s^2].
SimulatedRun heldOffBy(double error, const std::string& motion, std::uint64_t seed, double vibration = 0.0) {
  SimulatedRun run(motion, seed, 50.0, 5.0);
  run.setup.time_offset.constant = 0.03;
  run.setup.imu.accel_vibration = vibration;
  run.options.smoother.estimate_time_offset = false;
  run.options.radar.time_offset_initial = run.setup.time_offset.constant - error;
  run.run();
  return run;
}

/// A run with a lever arm that is `error` longer than the told one [m], along the axes of I.
SimulatedRun movedBy(const Vector3d& error, const std::string& motion, std::uint64_t seed,
                     double vibration_gyro = 0.0) {
  SimulatedRun run(motion, seed, 50.0, 5.0);
  run.setup.imu.gyro_vibration = vibration_gyro;
  run.options.radar.T_IR.l_I -= error;
  run.run();
  return run;
}

template <class Error>
double squaredSigmas(const Error& found, double told_sigma) {
  return found.sigmas(told_sigma) * found.sigmas(told_sigma);
}

TEST(CalibrationCheck, ItsSigmasAreWhatItsErrorsAre) {
  constexpr int kSeeds = 8;
  for (const char* motion : {"difficult", "drone", "start_in_motion"}) {
    double sum = 0.0, sum_of_scales = 0.0, sum_of_arms = 0.0;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      const SimulatedRun run = turnedBy(Vector3d::Zero(), motion, seed);
      const CalibrationErrors& at_end = run.last(0).errors;
      sum += squaredSigmas(*at_end.turn, 0.0) / 3.0;
      sum_of_arms += squaredSigmas(*at_end.lever_arm, 0.0) / 3.0;
      sum_of_scales += squaredSigmas(at_end.scale, 0.0);
      for (const ScanResult& result : run.results) {
        if (!result.updated) continue;
        std::ostringstream when;
        when << motion << ", seed " << seed << ", at " << run.seconds(result.state.time) << " s";
        EXPECT_LT(result.errors.turn->sigmas(kDegree), 3.0) << when.str();
        EXPECT_LT(result.errors.lever_arm->sigmas(0.01), 3.77) << when.str();
        EXPECT_LT(result.errors.scale.sigmas(0.03), 3.0) << when.str();
      }
    }
    EXPECT_GT(sum / kSeeds, 0.5) << motion;
    EXPECT_LT(sum / kSeeds, 2.0) << motion;
    EXPECT_GT(sum_of_arms / kSeeds, 0.5) << motion;
    EXPECT_LT(sum_of_arms / kSeeds, 2.0) << motion;
    EXPECT_GT(sum_of_scales / kSeeds, 0.3) << motion;
    EXPECT_LT(sum_of_scales / kSeeds, 2.5) << motion;
  }
}

TEST(CalibrationCheck, FindsAWrongMounting) {
  for (const Vector3d& axis : {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, 0, 1)}) {
    for (const char* motion : {"difficult", "medium", "drone"}) {
      const Vector3d turn = 8.0 * kDegree * axis;
      const VectorError found = *turnedBy(turn, motion, 1).last(0).errors.turn;
      // Tilt and biases of the estimate give way, too, so what is found may be short.
      EXPECT_LT((found.error - turn).norm(), turn.norm() / 4.0)
          << motion << ": " << (found.error / kDegree).transpose();
      EXPECT_LT(3.0 * found.sigma().maxCoeff(), 0.5 * turn.norm()) << motion;
    }
  }
}

TEST(CalibrationCheck, FindsAWrongScale) {
  for (const EstimateExtrinsics estimate : {EstimateExtrinsics::kNone, EstimateExtrinsics::kPose}) {
    for (const char* motion : {"difficult", "medium", "drone"}) {
      for (const double factor : {0.5, 0.8, 1.25}) {
        const ScalarError found = scaledBy(factor, motion, 1, estimate).last(0).errors.scale;
        const double error = 1.0 - 1.0 / factor;
        // Tilt and biases of the estimate give way, too, so what is found may be short.
        const double share = found.error / error;
        EXPECT_GT(share, factor == 0.5 ? 0.4 : 0.6) << motion << ": " << found.error;
        EXPECT_LT(share, 1.3) << motion << ": " << found.error;
        EXPECT_GT(found.sigmas(0.03), 3.0) << motion << ": " << found.error;
      }
    }
  }
}

TEST(CalibrationCheck, FindsAWrongOffset) {
  for (const char* motion : {"difficult", "medium", "drone"}) {
    for (const double error : {-0.02, 0.05}) {
      const SimulatedRun run = heldOffBy(error, motion, 1);
      const ScalarError found = *run.last(0).errors.offset;
      EXPECT_LT(std::abs(found.error - error), std::abs(error) / 4.0) << motion << ": " << found.error;
      EXPECT_GT(found.sigmas(0.0), 3.0) << motion << ": " << found.error;
      // The others are not blamed for it.
      EXPECT_LT(run.last(0).errors.turn->sigmas(kDegree), 3.0) << motion;
      EXPECT_LT(run.last(0).errors.lever_arm->sigmas(0.01), 3.77) << motion;
      EXPECT_LT(run.last(0).errors.scale.sigmas(0.03), 3.0) << motion;
    }
  }
}

TEST(CalibrationCheck, FindsAWrongLeverArm) {
  for (const char* motion : {"difficult", "medium", "gym_loop"}) {
    for (const Vector3d& axis : {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, 0, 1)}) {
      const Vector3d error = 0.2 * axis;
      const SimulatedRun run = movedBy(error, motion, 1);
      const VectorError found = *run.last(0).errors.lever_arm;
      // Tilt and offset of the estimate give way, too, so what is found may be short.
      EXPECT_LT((found.error - error).norm(), error.norm() / 2.0)
          << motion << ": " << found.error.transpose();
      EXPECT_GT(found.sigmas(0.01), 3.77) << motion << ": " << found.error.transpose();
      // The others are not blamed for it.
      EXPECT_LT(run.last(0).errors.turn->sigmas(kDegree), 3.0) << motion;
      EXPECT_LT(run.last(0).errors.scale.sigmas(0.03), 3.0) << motion;
    }
  }
}

// A gyro that shakes tilts the estimate, and gravity then changes the velocity as a lever arm would.
TEST(CalibrationCheck, AVibrationIsNoWrongLeverArm) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const VectorError found =
        *movedBy(Vector3d::Zero(), "constant_speed", seed, 0.02).last(0).errors.lever_arm;
    EXPECT_LT(found.sigmas(0.01), 3.0) << found.error.transpose() << " +- " << found.sigma().transpose();
  }
}

// Noise of the IMU is in the innovations and in the derivatives by the offset.
TEST(CalibrationCheck, AVibrationIsNoWrongOffset) {
  double sum = 0.0;
  constexpr int kSeeds = 4;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const ScalarError found = *heldOffBy(0.0, "walk", seed, 2.0).last(0).errors.offset;
    EXPECT_LT(found.sigmas(0.0), 3.0) << found.error << " +- " << found.sigma();
    sum += found.error;
  }
  EXPECT_LT(std::abs(sum / kSeeds), 0.003);
}

TEST(CalibrationCheck, TheSigmaOfAHeldOffsetIsWhatItsErrorIs) {
  constexpr int kSeeds = 8;
  for (const char* motion : {"difficult", "drone"}) {
    double sum = 0.0;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      const ScalarError found = *heldOffBy(0.0, motion, seed).last(0).errors.offset;
      EXPECT_LT(found.sigmas(0.0), 3.0) << motion << ", seed " << seed;
      sum += squaredSigmas(found, 0.0);
    }
    EXPECT_GT(sum / kSeeds, 0.3) << motion;
    EXPECT_LT(sum / kSeeds, 2.5) << motion;
  }
}

TEST(CalibrationCheck, FindsAWrongTurnIfTheLeverArmIsEstimated) {
  const Vector3d turn(0.0, 8.0 * kDegree, 0.0);
  SimulatedRun run("difficult", 1, 50.0, 5.0);
  run.options.smoother.estimate_extrinsics = EstimateExtrinsics::kLeverArm;
  run.options.radar.T_IR.q_IR = so3::exp(-turn) * run.options.radar.T_IR.q_IR;
  run.run();
  EXPECT_FALSE(run.last(0).errors.lever_arm);
  ASSERT_TRUE(run.last(0).errors.turn);
  const Vector3d found = run.last(0).errors.turn->error;
  EXPECT_LT((found - turn).norm(), turn.norm() / 4.0) << (found / kDegree).transpose();
}

TEST(CalibrationCheck, RestShowsNothing) {
  SimulatedRun run("medium", 1, 40.0, 25.0);
  run.run([&](simulation::SensorData& data) {  // ends before the platform moves
    auto& samples = data.imu.samples;
    samples.erase(std::find_if(samples.begin(), samples.end(),
                               [&](const ImuMeasurement& sample) { return run.seconds(sample.time) > 24.0; }),
                  samples.end());
  });
  ASSERT_TRUE(run.last(0).at_rest);
  EXPECT_GT(run.last(0).errors.turn->sigma().minCoeff(), 0.5);
  EXPECT_GT(run.last(0).errors.lever_arm->sigma().minCoeff(), 0.5);
  EXPECT_GT(run.last(0).errors.scale.sigma(), 0.5);
}

TEST(CalibrationCheck, WhatIsEstimatedNeedsNoCheck) {
  SimulatedRun run("difficult", 1, 20.0, 5.0);
  run.options.smoother.estimate_extrinsics = EstimateExtrinsics::kRotation;
  run.run();
  EXPECT_FALSE(run.last(0).errors.turn);
  EXPECT_TRUE(run.last(0).errors.lever_arm);
  EXPECT_FALSE(run.last(0).errors.offset);
}

}  // namespace
}  // namespace rio_t
