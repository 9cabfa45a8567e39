// The chain: marginalisation and covariance against dense linear algebra. The smoother: a known motion is
// recovered.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "rio_t/core/so3.h"
#include "rio_t/smoother/chain.h"
#include "rio_t/smoother/fixed_lag_smoother.h"
#include "rio_t/smoother/initial_prior.h"
#include "synthetic_motion.h"

namespace rio_t {
namespace {

double wave(int i) { return std::sin(1.0 + 2.71 * i) + 0.4 * std::cos(0.9 * i * i); }

NodeMatrix positiveDefinite(int seed) {
  NodeMatrix A;
  for (int i = 0; i < A.size(); ++i) A(i) = wave(seed + i);
  return A * A.transpose() + 0.5 * NodeMatrix::Identity();
}

/// Of node k in a dense system.
Eigen::Index firstRow(Eigen::Index k) { return k * kNodeTangent; }

/// A chain of `nodes` nodes with made-up information, and the same as one dense system.
struct DenseChain {
  explicit DenseChain(int nodes)
      : chain(static_cast<std::size_t>(nodes)),
        H(Eigen::MatrixXd::Zero(firstRow(nodes), firstRow(nodes))),
        b(Eigen::VectorXd::Zero(firstRow(nodes))) {
    for (int k = 0; k < nodes; ++k) {
      chain.diagonal[k] = 4.0 * positiveDefinite(100 * k);
      for (int i = 0; i < kNodeTangent; ++i) chain.gradient[k](i) = wave(900 * k + i);
      H.block(firstRow(k), firstRow(k), kNodeTangent, kNodeTangent) = chain.diagonal[k];
      b.segment(firstRow(k), kNodeTangent) = chain.gradient[k];
      if (k + 1 == nodes) continue;
      for (int i = 0; i < kNodeTangent * kNodeTangent; ++i) chain.coupling[k](i) = 0.1 * wave(7000 * k + i);
      H.block(firstRow(k), firstRow(k + 1), kNodeTangent, kNodeTangent) = chain.coupling[k];
      H.block(firstRow(k + 1), firstRow(k), kNodeTangent, kNodeTangent) = chain.coupling[k].transpose();
    }
  }
  ChainSystem chain;
  Eigen::MatrixXd H;
  Eigen::VectorXd b;
};

TEST(Chain, MarginalisationGivesTheFullSolution) {
  // Linear: eliminate the first node, solve the rest with the prior it leaves, compare with the full solve.
  DenseChain dense(3);
  const Eigen::VectorXd full = dense.H.ldlt().solve(-dense.b);

  const NodeInformation left =
      eliminateFirst(dense.chain.diagonal[0], dense.chain.coupling[0], dense.chain.gradient[0],
                     NodeMatrix::Zero(), NodeVector::Zero());
  Eigen::MatrixXd H = dense.H.bottomRightCorner(2 * kNodeTangent, 2 * kNodeTangent);
  Eigen::VectorXd b = dense.b.tail(2 * kNodeTangent);
  H.topLeftCorner<kNodeTangent, kNodeTangent>() += left.S;
  b.head<kNodeTangent>() += left.s;
  const Eigen::VectorXd rest = H.ldlt().solve(-b);
  EXPECT_LT((rest - full.tail(2 * kNodeTangent)).norm(), 1e-10 * full.norm());
}

TEST(Chain, ThePriorCarriesInformationAndGradient) {
  NodeInformation information;
  information.S = positiveDefinite(5);
  information.S.row(3) *= 1e6;  // as different as metres and biases
  information.S.col(3) *= 1e6;
  for (int i = 0; i < kNodeTangent; ++i) information.s(i) = wave(40 + i);
  const NodePrior prior = priorFromInformation(information, StateBlock(), 0.02);
  const NodeVector scale = information.S.diagonal().cwiseSqrt();
  const NodeMatrix error = scale.cwiseInverse().asDiagonal() *
                           (prior.J.transpose() * prior.J - information.S) *
                           scale.cwiseInverse().asDiagonal();
  EXPECT_LT(error.norm(), 1e-10);
  EXPECT_LT((prior.J.transpose() * prior.r0 - information.s).cwiseQuotient(scale).norm(), 1e-9);
  EXPECT_DOUBLE_EQ(prior.t_O0, 0.02);
}

TEST(Chain, ASingularPriorLeavesTheUnknownFree) {
  NodeInformation information;
  information.S(2, 2) = 4.0;
  information.s(2) = 1.0;
  const NodePrior prior = priorFromInformation(information, StateBlock(), 0.0);
  EXPECT_LT((prior.J.transpose() * prior.J - information.S).norm(), 1e-12);
  EXPECT_TRUE(prior.r0.allFinite());
}

TEST(Chain, CovarianceOfTheLastNodeIsThatOfTheFullInverse) {
  const DenseChain dense(4);
  const Eigen::MatrixXd covariance = dense.H.inverse();
  ChainSolution solution;
  const NodeMatrix last = covarianceOfLast(dense.chain, &solution);
  EXPECT_LT((last - covariance.bottomRightCorner<kNodeTangent, kNodeTangent>()).norm(),
            1e-12 + 1e-9 * last.norm());
}

TEST(Chain, SolutionIsThatOfTheFullSystem) {
  const DenseChain dense(4);
  Eigen::MatrixXd H = dense.H;
  for (const double damping : {0.0, 0.3}) {
    H.diagonal() = (1.0 + damping) * dense.H.diagonal();
    const Eigen::VectorXd full = H.ldlt().solve(-dense.b);
    ChainSolution solution;
    ASSERT_TRUE(solve(dense.chain, damping, &solution));
    for (int k = 0; k < 4; ++k) {
      EXPECT_LT((solution.delta[k] - full.segment<kNodeTangent>(firstRow(k))).norm(), 1e-9 * full.norm());
    }
    EXPECT_NEAR(solution.decrease, full.dot(H * full), 1e-9 * solution.decrease);
  }
  DenseChain indefinite(2);
  indefinite.chain.diagonal[1].setZero();
  ChainSolution solution;
  EXPECT_FALSE(solve(indefinite.chain, 0.0, &solution));
}

class Smoother : public ::testing::Test {
 protected:
  static constexpr double kEnd = 4.0;

  explicit Smoother() : imu(motion.imu(0.0, kEnd + 0.5, 400.0)) {}

  RadarVelocityMeasurement measurement(double stamp, double t_O) const {
    RadarVelocityMeasurement z;
    z.stamp = motion.time(stamp);
    z.R_RI = so3::exp({0.3, -1.2, 2.0}).toRotationMatrix();
    z.l_I = {0.03, -0.1, 0.05};
    z.v_R = motion.radarVelocity(stamp - t_O, z.R_RI, z.l_I);
    z.covariance = 0.02 * 0.02 * Eigen::Matrix3d::Identity();
    return z;
  }

  FixedLagSmoother make(SmootherOptions options) const {
    FixedLagSmoother smoother(options, ImuNoise(), motion.g_W, imu);
    smoother.initialize(motion.time(0.5), priorAtRest(options, motion.state(0.5), 1e-4));
    return smoother;
  }

  SyntheticMotion motion;
  ImuBuffer imu;
};

TEST_F(Smoother, RecoversTheOffsetWithTheImuModel) {
  for (const double t_O : {-0.05, 0.0, 0.03, 0.12}) {
    SmootherOptions options;
    options.time_offset_model = TimeOffsetModel::kImu;
    FixedLagSmoother smoother = make(options);
    for (double stamp = 0.7; stamp < kEnd; stamp += 0.1) {
      smoother.add(measurement(stamp, t_O));
      smoother.optimize();
      smoother.marginalize();
    }
    EXPECT_NEAR(smoother.newest().t_O, t_O, 2e-4);
    const NodeEstimate newest = smoother.newest();
    const StateBlock truth = motion.state(newest.time - motion.start);
    EXPECT_LT((newest.x.p_W() - truth.p_W()).norm(), 5e-3);
    EXPECT_LT((newest.x.v_W() - truth.v_W()).norm(), 5e-3);
    EXPECT_LT(so3::log(newest.x.q_WI().conjugate() * truth.q_WI()).norm(), 5e-3);
  }
}

TEST_F(Smoother, BothSolversFindTheSame) {
  SmootherOptions options;
  options.max_iterations = 100;
  FixedLagSmoother chain = make(options);
  options.solver = WindowSolverKind::kCeres;
  FixedLagSmoother ceres = make(options);
  for (double stamp = 0.7; stamp < kEnd; stamp += 0.1) {
    // From 0 to 120 ms is far enough for steps that fail, and noise enough for the loss to matter.
    RadarVelocityMeasurement z = measurement(stamp, 0.12);
    z.v_R += 0.03 * Eigen::Vector3d(std::sin(50 * stamp), std::sin(71 * stamp), std::cos(93 * stamp));
    for (FixedLagSmoother* smoother : {&chain, &ceres}) {
      smoother->add(z);
      smoother->optimize();
      smoother->marginalize();
    }
    const NodeEstimate a = chain.newest();
    const NodeEstimate b = ceres.newest();
    const NodeMatrix& P = ceres.newestCovariance();
    const NodeVector sigma = P.diagonal().cwiseSqrt();
    NodeVector difference;
    difference << boxminus(a.x.data(), b.x.data()), a.t_O - b.t_O;
    // Each ends where its last step is shorter than that (eq. 23a).
    EXPECT_LT(difference.cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 0.1) << "at " << stamp;
    EXPECT_LT(
        (chain.newestCovariance().diagonal().cwiseSqrt() - sigma).cwiseQuotient(sigma).cwiseAbs().maxCoeff(),
        0.02)
        << "at " << stamp;
  }
}

TEST_F(Smoother, TheWindowIsBoundedAndKeepsItsCertainty) {
  SmootherOptions options;
  FixedLagSmoother smoother = make(options);
  std::vector<NodeEstimate> left;
  for (double stamp = 0.7; stamp < kEnd; stamp += 0.1) {
    smoother.add(measurement(stamp, 0.0));
    smoother.optimize();
    for (const NodeEstimate& node : smoother.marginalize()) left.push_back(node);
    EXPECT_LE(smoother.newest().time - smoother.node(0).time, options.window + 1e-6);
  }
  EXPECT_GT(left.size(), 20u);
  for (std::size_t k = 1; k < left.size(); ++k) EXPECT_LT(left[k - 1].time, left[k].time);
  // Had states been dropped instead of marginalised, the position would be as unknown as a window leaves it.
  const NodeMatrix& P = smoother.newestCovariance();
  EXPECT_GT(P(0, 0), 0.0);
  EXPECT_LT(std::sqrt(P(StateBlock::kP, StateBlock::kP)), 0.1);
}

TEST_F(Smoother, AShortWindowEqualsALongOneWhereTheProblemIsNearlyLinear) {
  SmootherOptions short_window, long_window;
  short_window.window = 0.3;
  long_window.window = 100.0;
  short_window.huber_threshold = long_window.huber_threshold = 0.0;
  FixedLagSmoother a = make(short_window), b = make(long_window);
  for (double stamp = 0.7; stamp < 2.5; stamp += 0.1) {
    for (FixedLagSmoother* smoother : {&a, &b}) {
      smoother->add(measurement(stamp, 0.004));
      smoother->optimize();
      smoother->marginalize();
    }
  }
  EXPECT_GT(b.size(), 15u);
  EXPECT_LT(a.size(), 6u);
  EXPECT_LT((a.newest().x.p_W() - b.newest().x.p_W()).norm(), 1e-3);
  EXPECT_NEAR(a.newest().t_O, b.newest().t_O, 2e-4);
  EXPECT_NEAR(std::log(a.newestCovariance()(15, 15) / b.newestCovariance()(15, 15)), 0.0, 0.1);
}

TEST_F(Smoother, APositionThatIsHardlyKnownStopsNothing) {
  SmootherOptions options;
  options.prior_sigma_position = 1e5;  // beside an IMU factor that knows it to a tenth of a millimetre
  FixedLagSmoother smoother = make(options);
  for (double stamp = 0.7; stamp < kEnd; stamp += 0.02) {
    smoother.add(measurement(stamp, 0.03));
    smoother.optimize();
    smoother.marginalize();
  }
  EXPECT_NEAR(smoother.newest().t_O, 0.03, 2e-4);
  const NodeMatrix& P = smoother.newestCovariance();
  EXPECT_GT(std::sqrt(P(StateBlock::kP, StateBlock::kP)), 10.0);
  EXPECT_LT(std::sqrt(P(StateBlock::kV, StateBlock::kV)), 0.1);
}

TEST_F(Smoother, ALateScanIsInsertedAtItsTime) {
  SmootherOptions options;
  FixedLagSmoother in_order = make(options), late = make(options);
  for (const double stamp : {0.7, 0.8, 0.9, 1.0})
    EXPECT_EQ(in_order.add(measurement(stamp, 0.0)), FixedLagSmoother::AddResult::kAdded);
  for (const double stamp : {0.7, 0.9, 1.0, 0.8})
    EXPECT_EQ(late.add(measurement(stamp, 0.0)), FixedLagSmoother::AddResult::kAdded);
  for (int i = 0; i < 3; ++i) {
    in_order.optimize();
    late.optimize();
  }
  ASSERT_EQ(in_order.size(), late.size());
  for (std::size_t k = 0; k < late.size(); ++k) {
    EXPECT_EQ(late.node(k).time, in_order.node(k).time);
    EXPECT_LT(boxminus(late.node(k).x.data(), in_order.node(k).x.data()).norm(), 1e-6);
  }
  EXPECT_EQ(late.add(measurement(0.3, 0.0)), FixedLagSmoother::AddResult::kOlderThanWindow);
  EXPECT_EQ(late.add(measurement(0.9, 0.0)), FixedLagSmoother::AddResult::kDuplicateStamp);
}

TEST_F(Smoother, ScansThatSayNothingOfTheOffsetLeaveIt) {
  SmootherOptions options;
  FixedLagSmoother smoother = make(options);
  for (double stamp = 0.7; stamp < kEnd; stamp += 0.1) {
    RadarVelocityMeasurement z = measurement(stamp, 0.0);
    z.held_t_O = smoother.newest().t_O;
    smoother.add(z);
    smoother.optimize();
    smoother.marginalize();
  }
  EXPECT_NEAR(smoother.newest().t_O, 0.0, 1e-9);
  const NodeMatrix& P = smoother.newestCovariance();
  EXPECT_GE(std::sqrt(P(StateBlock::kTangent, StateBlock::kTangent)),
            options.time_offset_sigma * (1.0 - 1e-9));
}

TEST_F(Smoother, WithoutEstimationTheOffsetStays) {
  SmootherOptions options;
  options.estimate_time_offset = false;
  options.time_offset_initial = 0.01;
  FixedLagSmoother smoother = make(options);
  for (double stamp = 0.7; stamp < kEnd; stamp += 0.1) {
    smoother.add(measurement(stamp, 0.03));
    smoother.optimize();
    smoother.marginalize();
  }
  EXPECT_DOUBLE_EQ(smoother.newest().t_O, 0.01);
}

TEST_F(Smoother, PredictsTheVelocityOfTheNextScan) {
  SmootherOptions options;
  options.time_offset_initial = 0.02;
  options.time_offset_sigma = 0.001;
  FixedLagSmoother smoother = make(options);
  const RadarVelocityMeasurement z = measurement(0.7, 0.02);
  const auto prior = smoother.predictRadarVelocity(z.stamp, z.R_RI, z.l_I);
  ASSERT_TRUE(prior);
  EXPECT_LT((prior->velocity.v_R - z.v_R).norm(), 2e-3);
  // An offset that is less known makes the prediction less certain, where the platform accelerates.
  options.time_offset_sigma = 0.1;
  const auto unsure = make(options).predictRadarVelocity(z.stamp, z.R_RI, z.l_I);
  EXPECT_GT(unsure->velocity.covariance.trace(), 4.0 * prior->velocity.covariance.trace());
}

}  // namespace
}  // namespace rio_t
