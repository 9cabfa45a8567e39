#include "rio_t/odometry/mounting_check.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <string>

#include "rio_t/core/angle.h"
#include "rio_t/core/so3.h"
#include "simulated_run.h"

namespace rio_t {
namespace {

using Eigen::Vector3d;

/// What the check says at the end of a run whose mounting is turned by `turn` from the told one, about the
/// axes of I [rad].
MountingTurn found(const std::string& motion, std::uint64_t seed, const Vector3d& turn) {
  SimulatedRun run(motion, seed, 50.0, 5.0);
  run.options.T_IR.q_IR = so3::exp(-turn) * run.setup.T_IR.q_IR;
  run.run();
  return run.last(0).told_turn.value();
}

TEST(MountingCheck, ItsSigmasAreWhatItsErrorsAre) {
  constexpr int kSeeds = 8;
  for (const char* motion : {"difficult", "drone", "start_in_motion"}) {
    double sum = 0.0;
    for (int seed = 1; seed <= kSeeds; ++seed) {
      const MountingTurn turn = found(motion, static_cast<std::uint64_t>(seed), Vector3d::Zero());
      sum += turn.turn.dot(turn.covariance.ldlt().solve(turn.turn)) / 3.0;
    }
    EXPECT_GT(sum / kSeeds, 0.5) << motion;
    EXPECT_LT(sum / kSeeds, 2.0) << motion;
  }
}

TEST(MountingCheck, FindsAWrongMounting) {
  for (const Vector3d& axis : {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, 0, 1)}) {
    for (const char* motion : {"difficult", "medium", "drone"}) {
      const Vector3d turn = 8.0 * kDegree * axis;
      const MountingTurn result = found(motion, 1, turn);
      // Tilt and biases of the estimate give way, too, so what is found may be short.
      EXPECT_LT((result.turn - turn).norm(), turn.norm() / 4.0)
          << motion << ": " << (result.turn / kDegree).transpose();
      EXPECT_LT(3.0 * result.sigma().maxCoeff(), 0.5 * turn.norm()) << motion;
    }
  }
}

TEST(MountingCheck, RestShowsNothing) {
  SimulatedRun run("medium", 1, 40.0, 25.0);
  run.run([&](simulation::SensorData& data) {  // ends before the platform moves
    auto& samples = data.imu.samples;
    samples.erase(std::find_if(samples.begin(), samples.end(),
                               [&](const ImuMeasurement& sample) { return run.seconds(sample.time) > 24.0; }),
                  samples.end());
  });
  ASSERT_TRUE(run.last(0).at_rest);
  EXPECT_GT(run.last(0).told_turn->sigma().minCoeff(), 0.5);
}

TEST(MountingCheck, AMountingThatIsEstimatedNeedsNoCheck) {
  SimulatedRun run("difficult", 1, 20.0, 5.0);
  run.options.smoother.estimate_extrinsics = EstimateExtrinsics::kRotation;
  run.run();
  EXPECT_FALSE(run.last(0).told_turn);
}

}  // namespace
}  // namespace rio_t
