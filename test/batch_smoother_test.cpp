// The batch against dense linear algebra, against the fixed-lag smoother that keeps everything, and against
// the truth.
#include "rio_t/smoother/batch_smoother.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "dense_system.h"
#include "noise.h"
#include "radar_smoother.h"
#include "rio_t/core/so3.h"

namespace rio_t {
namespace {

/// Largest difference between two covariances, in standard deviations.
double difference(const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& expected) {
  const Eigen::VectorXd scale = expected.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd apart = scale.asDiagonal() * (covariance - expected) * scale.asDiagonal();
  return apart.cwiseAbs().maxCoeff();
}

class Batch : public ::testing::Test {
 protected:
  static constexpr double kEnd = 4.0;

  Batch() : imu(motion.imu(0.0, kEnd + 0.5, 400.0)) {}

  /// `error` [m/s] scales a made-up error of each axis.
  RadarVelocityMeasurement measurement(double stamp, double t_O, double error = 0.0) const {
    RadarVelocityMeasurement z = radarMeasurement(motion, stamp, t_O);
    const int i = static_cast<int>(std::lround(100.0 * stamp));
    z.v_R += error * Eigen::Vector3d(wave(i), wave(i + 1), wave(i + 2));
    return z;
  }

  BatchProblem problem(const SmootherOptions& options,
                       const CalibrationPrior& radar = {skewMounting()}) const {
    BatchProblem problem;
    problem.start = motion.time(0.5);
    problem.prior = priorAtRest(options, ImuNoise(), motion.state(0.5), 9.81, 3.0, radar);
    problem.radars = {radar};
    problem.guess = {{problem.start, motion.state(0.5)}};
    return problem;
  }

  /// Scans of one radar with one t_O, from `begin` to `end` [s]; `error` as in measurement().
  void addScans(double begin, double end, double t_O, BatchProblem& problem, double error = 0.0) const {
    for (double stamp = begin; stamp < end; stamp += 0.1) {
      BatchScan scan;
      scan.velocity = measurement(stamp, t_O, error);
      scan.stamp = scan.velocity->stamp;
      problem.scans.push_back(scan);
    }
  }

  /// Scans of one radar; t_O steps from `before` to `after` in the middle, and the first scan after it tells.
  void addScansWithStep(double before, double after, BatchProblem& problem) const {
    for (double stamp = 0.7; stamp < kEnd; stamp += 0.1) {
      const bool has_stepped = stamp > 2.25;
      BatchScan scan;
      scan.velocity = measurement(stamp, has_stepped ? after : before);
      scan.stamp = scan.velocity->stamp;
      scan.offset_stepped = has_stepped && stamp < 2.35;
      problem.scans.push_back(scan);
    }
  }

  BatchSmoother make(const SmootherOptions& options) const {
    return {options, BatchOptions(), ImuNoise(), motion.g_W, imu};
  }

  SyntheticMotion motion;
  ImuBuffer imu;
};

TEST_F(Batch, EqualsTheFixedLagSmootherThatKeepsEverything) {
  for (const TimeOffsetModel model : {TimeOffsetModel::kConstantAcceleration, TimeOffsetModel::kImu}) {
    for (const double huber : {0.0, 1.5}) {
      SmootherOptions options;
      options.time_offset_model = model;
      options.huber_threshold = huber;
      options.window = 100.0;
      options.time_offset_noise =
          1e-7;  // the paper's t_O of each node, and one for all, are the same where it is constant
      const CalibrationPrior radar{skewMounting(), 0.02, 0.02};
      options.max_iterations = 50;
      RadarSmoother online(options, radar, motion.g_W, imu);
      BatchProblem whole = problem(options, radar);
      online.initialize(whole.start, whole.prior);
      for (double stamp = 0.7; stamp < kEnd; stamp += 0.1) {
        BatchScan scan;
        scan.velocity = measurement(stamp, 0.02, 0.03);
        scan.stamp = scan.velocity->stamp;
        if (stamp < 1.0) scan.rest_velocity_sigma = 3.0;
        // The time of the window's node: another time splits the IMU's noise in another way.
        scan.t_O = model == TimeOffsetModel::kImu ? scan.stamp - online.radar.nodeTime(scan.stamp) : 0.02;
        // The batch takes the measurement to first order around there.
        if (model == TimeOffsetModel::kImu)
          scan.velocity->linear_from_t_O = std::make_shared<const double>(scan.t_O);
        whole.scans.push_back(scan);
        online.add(*scan.velocity);
        if (scan.rest_velocity_sigma) online.addRest(scan.stamp, *scan.rest_velocity_sigma);
        for (int i = 0; i < 6; ++i) online.optimize();  // to rest: one ends within 0.1 sigma
        ASSERT_TRUE(online.marginalize().empty());
      }
      BatchOptions fixed_nodes;
      fixed_nodes.placement_tolerance = 1.0;
      const BatchSolution batch =
          BatchSmoother(options, fixed_nodes, ImuNoise(), motion.g_W, imu).solve(whole);
      EXPECT_TRUE(batch.converged());
      EXPECT_EQ(batch.placements, 1);
      ASSERT_EQ(batch.nodes.size(), online.size());
      for (std::size_t k = 0; k < online.size(); ++k) {
        const NodeEstimate node = online.node(k);
        ASSERT_EQ(batch.nodes[k].time, node.time);
        const StateTangent apart = boxminus(batch.nodes[k].x.data(), node.x.data());
        const StateTangent sigma = batch.covariances[k].diagonal().cwiseSqrt();
        EXPECT_LT(apart.cwiseQuotient(sigma).norm(), 0.01) << "node " << k;
      }
      for (const BatchSolution::Scan& scan : batch.scans)
        EXPECT_LT(std::abs(scan.t_O - online.t_O()), 0.01 * std::sqrt(scan.covariance(15, 15)));
      const Eigen::VectorXd last = batch.scans.back().covariance.diagonal();
      EXPECT_LT((online.newestCovariance().diagonal().cwiseQuotient(last).array() - 1.0).abs().maxCoeff(),
                1e-3);
    }
  }
}

TEST_F(Batch, CovarianceIsThatOfTheDenseInverse) {
  for (const double window : {10.0, 0.3}) {  // one block of biases, and several
    SmootherOptions options;
    options.window = window;
    BatchProblem whole = problem(options);
    addScans(0.7, 2.0, 0.01, whole, 0.03);
    const BatchSolution batch = make(options).solve(whole);
    // Scaled to a unit diagonal: metres and biases together are beyond what a dense inverse can hold.
    const Dense dense(batch.system);
    const Eigen::VectorXd scale = dense.H.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled = scale.asDiagonal() * dense.H * scale.asDiagonal();
    const Eigen::MatrixXd covariance = scale.asDiagonal() * scaled.inverse() * scale.asDiagonal();
    std::vector<Eigen::Index> motions, biases, offsets;  // first columns; each node has an offset
    for (std::size_t i = 0; i < dense.first.size(); ++i) {
      if (batch.system.is_held[i]) continue;
      const Eigen::Index size = batch.system.tangents[i];
      (size == StateBlock::kMotionTangent ? motions : size == 1 ? offsets : biases).push_back(dense.first[i]);
    }
    ASSERT_EQ(biases.size(), window > 1.0 ? 1u : 4u);
    std::vector<std::size_t> biases_of = {0};  // by node
    Time end = batch.nodes.front().time + window;
    for (std::size_t k = 1; k < batch.nodes.size(); ++k) {
      const Time before = batch.nodes[k - 1].time;
      biases_of.push_back(biases_of.back() + (before >= end ? 1 : 0));
      if (before >= end) end = before + window;
    }
    for (const BatchSolution::Scan& scan : batch.scans) {
      std::vector<Eigen::Index> order;
      const auto add = [&](Eigen::Index first, int size) {
        for (int k = 0; k < size; ++k) order.push_back(first + k);
      };
      add(motions[scan.node], StateBlock::kMotionTangent);
      add(biases[biases_of[scan.node]], StateBlock::kBiases);
      add(offsets[scan.node], 1);
      Eigen::MatrixXd expected(16, 16);
      for (std::size_t i = 0; i < order.size(); ++i)
        for (std::size_t j = 0; j < order.size(); ++j)
          expected(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
              covariance(order[i], order[j]);
      EXPECT_LT(difference(scan.covariance, expected), 1e-6) << window;
      EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(scan.covariance).eigenvalues().minCoeff(),
                0.0);
    }
  }
}

TEST_F(Batch, PlacesItsNodesWhereTheOffsetPutsThem) {
  // From zero, with an offset that the nodes must follow by as much as the time between two scans.
  for (const double t_O : {-0.05, 0.1, 0.2}) {
    const SmootherOptions options;
    // So that the prior does not pull at these few scans.
    BatchProblem whole = problem(options, {skewMounting(), 0.0, 1.0});
    addScans(0.8, kEnd, t_O, whole);
    const BatchSolution batch = make(options).solve(whole);
    EXPECT_TRUE(batch.converged());
    EXPECT_GT(batch.placements, 1);
    for (std::size_t i = 0; i < whole.scans.size(); ++i) {
      const BatchSolution::Scan& scan = batch.scans[i];
      const NodeEstimate& node = batch.nodes[scan.node];
      EXPECT_NEAR(scan.t_O, t_O, 1e-4);
      EXPECT_NEAR(node.time - (whole.scans[i].stamp - scan.t_O), 0.0, 1.1e-4);
      const StateBlock truth = motion.state(node.time - motion.start);
      EXPECT_LT((node.x.p_W() - truth.p_W()).norm(), 3e-3);
      EXPECT_LT(so3::log(node.x.q_WI().conjugate() * truth.q_WI()).norm(), 3e-3);
    }
  }
}

TEST_F(Batch, KnowsThePastBetterThanTheWindowDid) {
  SmootherOptions options;
  RadarSmoother online(options, {skewMounting()}, motion.g_W, imu);
  BatchProblem whole = problem(options);
  online.initialize(whole.start, whole.prior);
  Eigen::VectorXd then;
  for (double stamp = 0.7; stamp < kEnd; stamp += 0.1) {
    BatchScan scan;
    scan.velocity = measurement(stamp, 0.01);
    scan.stamp = scan.velocity->stamp;
    whole.scans.push_back(scan);
    online.add(*scan.velocity);
    online.optimize();
    online.marginalize();
    if (whole.scans.size() == 5) then = online.newestCovariance().diagonal();
  }
  const BatchSolution batch = make(options).solve(whole);
  const Eigen::VectorXd now = batch.scans[4].covariance.diagonal();
  for (const int i : {0, 1, 6, 7, 8, 12, 13, 14, 15}) EXPECT_LT(now(i), 0.95 * then(i)) << i;
}

TEST_F(Batch, TheBiasesOfABatchWalk) {
  // The gyro drifts by 0.01 rad/s, evenly over the run.
  constexpr double kDrift = 0.01 / kEnd;  // [rad/s^2]
  ImuBuffer drifting;
  imu.forEachSample(motion.time(0.0), motion.time(kEnd + 0.5), [&](ImuMeasurement s) {
    s.angular_velocity.x() += kDrift * (s.time - motion.time(0.5));
    drifting.add(s);
  });
  ImuNoise noise;
  noise.gyro_random_walk = 0.05;
  SmootherOptions options;
  options.window = 0.5;
  BatchProblem whole = problem(options);
  addScans(0.7, kEnd, 0.0, whole);
  for (BatchScan& scan : whole.scans) scan.velocity->covariance *= 0.01;
  const BatchSolution batch =
      BatchSmoother(options, BatchOptions(), noise, motion.g_W, drifting).solve(whole);
  EXPECT_TRUE(batch.converged());
  const auto drift = [&](const NodeEstimate& node) { return node.x.b_g().x() - motion.b_g.x(); };
  EXPECT_NEAR(drift(batch.nodes.front()), 0.0, 2e-3);
  EXPECT_NEAR(drift(batch.nodes[batch.nodes.size() / 2]), 0.5 * kDrift * (kEnd - 0.5), 2e-3);
  EXPECT_NEAR(drift(batch.nodes.back()), kDrift * (kEnd - 0.5), 2e-3);
}

TEST_F(Batch, AStepOfTheOffsetIsFollowedWhereItIsTold) {
  SmootherOptions options;
  BatchProblem whole = problem(options);
  addScansWithStep(0.01, 0.06, whole);
  const BatchSolution batch = make(options).solve(whole);
  EXPECT_NEAR(batch.scans.front().t_O, 0.01, 3e-4);
  EXPECT_NEAR(batch.scans.back().t_O, 0.06, 3e-4);
}

TEST_F(Batch, AStepHasTheSigmaOfItsRadar) {
  const SmootherOptions options;
  BatchProblem whole = problem(options, {skewMounting(), 0.0, 1e-4});
  whole.radars.front().time_offset_sigma = 0.075;
  addScansWithStep(0.0, 0.05, whole);
  EXPECT_NEAR(make(options).solve(whole).scans.back().t_O, 0.05, 3e-4);
}

/// Two radars with one clock measure at the same time, and the second one tells of the step.
TEST_F(Batch, AStepIsFollowedThoughAnotherRadarHasTheNode) {
  SmootherOptions options;
  options.time_offset_shared = true;
  BatchProblem whole = problem(options);
  whole.radars.push_back(whole.radars.front());
  for (double stamp = 0.7; stamp < kEnd; stamp += 0.1) {
    const bool after = stamp > 2.25;
    for (const std::size_t radar : {0, 1}) {
      BatchScan scan;
      scan.velocity = measurement(stamp, after ? 0.06 : 0.01);
      scan.stamp = scan.velocity->stamp;
      scan.radar = radar;
      scan.offset_stepped = radar == 1 && after && stamp < 2.35;
      whole.scans.push_back(scan);
    }
  }
  const BatchSolution batch = make(options).solve(whole);
  EXPECT_NEAR(batch.scans.back().t_O, 0.06, 1e-3);
}

/// Two radars with one trigger see the same rest.
TEST_F(Batch, RestOfOneNodeCountsOnce) {
  const SmootherOptions options;
  const CalibrationPrior radar{skewMounting(), 0.02, 0.02};
  std::vector<StateCovariance> covariances;
  for (const bool both : {false, true}) {
    BatchProblem whole = problem(options, radar);
    whole.radars = {radar, radar};
    for (double stamp = 0.7; stamp < kEnd; stamp += 0.1) {
      for (const std::size_t k : {0, 1}) {
        BatchScan scan;
        scan.radar = k;
        scan.velocity = measurement(stamp, 0.02);
        scan.stamp = scan.velocity->stamp;
        if (k == 0 || both) scan.rest_velocity_sigma = 0.01;
        whole.scans.push_back(scan);
      }
    }
    covariances.push_back(make(options).solve(whole).covariances.back());
  }
  EXPECT_LT((covariances[0] - covariances[1]).norm(), 1e-6 * covariances[0].norm());
}

TEST_F(Batch, ASharedOffsetBeginsWhereItsPriorIs) {
  SmootherOptions options;
  options.time_offset_shared = true;
  BatchProblem whole = problem(options, {skewMounting(), 0.0, 1e-4});
  whole.radars.push_back(whole.radars.front());
  whole.radar = 1;
  whole.prior.t_O0 = 0.04;
  for (double stamp = 0.7; stamp < 1.5; stamp += 0.1) {
    BatchScan scan;
    scan.velocity = measurement(stamp, 0.04);
    scan.stamp = scan.velocity->stamp;
    scan.t_O = 0.04;
    scan.radar = 1;
    whole.scans.push_back(scan);
  }
  EXPECT_NEAR(make(options).solve(whole).scans.front().t_O, 0.04, 2e-4);
}

TEST_F(Batch, ATruthBeyondTheBoundIsTold) {
  SmootherOptions options;
  options.max_time_offset = 0.05;
  BatchProblem whole = problem(options);
  addScans(0.7, kEnd, 0.08, whole);
  const BatchSolution batch = make(options).solve(whole);
  EXPECT_EQ(batch.termination, SolverTermination::kAtBound);
  EXPECT_LT(batch.iterations, 50);
  EXPECT_NEAR(batch.scans.back().t_O, 0.05, 1e-9);
}

TEST_F(Batch, WithoutEstimationTheOffsetStays) {
  SmootherOptions options;
  options.estimate_time_offset = false;
  BatchProblem whole = problem(options, {skewMounting(), 0.01});
  for (double stamp = 0.7; stamp < kEnd; stamp += 0.1) {
    BatchScan scan;
    scan.velocity = measurement(stamp, 0.03);
    scan.stamp = scan.velocity->stamp;
    scan.t_O = 0.01;
    whole.scans.push_back(scan);
  }
  for (const BatchSolution::Scan& scan : make(options).solve(whole).scans) EXPECT_DOUBLE_EQ(scan.t_O, 0.01);
}

TEST_F(Batch, NothingToBeginFromIsRefused) {
  BatchProblem nothing = problem(SmootherOptions());
  nothing.guess.clear();
  EXPECT_THROW(make(SmootherOptions()).solve(nothing), std::invalid_argument);
}

}  // namespace
}  // namespace rio_t
