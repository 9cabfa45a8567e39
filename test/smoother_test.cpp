// The chain: marginalisation and covariance against dense linear algebra. The window: its normal equations
// against Ceres, its minimum and why the solver stopped. The smoother: a known motion is recovered.
#include <ceres/crs_matrix.h>
#include <ceres/problem.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <functional>
#include <memory>
#include <utility>

#include "rio_t/core/so3.h"
#include "rio_t/factors/state_manifold.h"
#include "rio_t/smoother/chain.h"
#include "rio_t/smoother/chain_marginals.h"
#include "rio_t/smoother/factor_pool.h"
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

TEST(Chain, AHeldOffsetIsARowAndColumnLess) {
  const DenseChain dense(3);
  const Eigen::Index held = firstRow(1) + StateBlock::kTangent;
  const double step = 0.3;
  // Without the row of t_O,1, whose column times the step goes to the right side.
  Eigen::MatrixXd H = dense.H;
  Eigen::VectorXd b = dense.b + step * H.col(held);
  H.row(held).setZero();
  H.col(held).setZero();
  H(held, held) = 1.0;
  b(held) = -step;
  const Eigen::VectorXd full = H.ldlt().solve(-b);

  ChainSystem chain = dense.chain;
  chain.holdOffset(1, step);
  ChainSolution solution;
  ASSERT_TRUE(solve(chain, 0.0, &solution));
  EXPECT_EQ(solution.delta[1](StateBlock::kTangent), 0.0);
  solution.delta[1](StateBlock::kTangent) = step;
  for (int k = 0; k < 3; ++k) {
    EXPECT_LT((solution.delta[k] - full.segment<kNodeTangent>(firstRow(k))).norm(), 1e-9 * full.norm());
  }
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
    smoother.initialize(motion.time(0.5), priorAtRest(options, ImuNoise(), motion.state(0.5), 9.81, 3.0));
    return smoother;
  }

  SyntheticMotion motion;
  ImuBuffer imu;
};

/// With the Jacobians of the wrong sign.
class WrongSigned final : public RadarCost {
 public:
  explicit WrongSigned(std::unique_ptr<RadarCost> right) : right_(std::move(right)) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    if (!right_->Evaluate(parameters, residuals, jacobians)) return false;
    if (jacobians == nullptr) return true;
    if (jacobians[0] != nullptr) Eigen::Map<StateJacobian<3>>{jacobians[0]} *= -1.0;
    if (jacobians[1] != nullptr) Eigen::Map<Eigen::Vector3d>{jacobians[1]} *= -1.0;
    return true;
  }

 private:
  std::unique_ptr<RadarCost> right_;
};

class Windows : public Smoother {
 protected:
  static constexpr int kNodes = 9;
  using Solve = std::function<SolveReport(Window&, const SolverLimits&)>;

  /// With every kind of factor, beside its minimum. `t_O` [s] is the true one at node k.
  Window window(const SmootherOptions& options, const std::function<double(int)>& t_O) const {
    FactorPool pool(options, ImuNoise(), motion.g_W, imu);
    Window result;
    result.prior =
        std::make_unique<PriorFactor>(priorAtRest(options, ImuNoise(), motion.state(0.5), 9.81, 3.0));
    result.loss = std::make_unique<ceres::HuberLoss>(options.huber_threshold);
    result.max_time_offset = options.max_time_offset;
    for (int k = 0; k < kNodes; ++k) {
      const double t = 0.5 + 0.1 * k;
      WindowNode node;
      node.time = motion.time(t);
      StateTangent beside;
      for (int i = 0; i < StateBlock::kTangent; ++i)
        beside(i) = (i < StateBlock::kBg ? 0.01 : 1e-3) * wave(17 * k + i);
      const StateBlock truth = motion.state(t);
      boxplus(truth.data(), beside.data(), node.x.data());
      RadarVelocityMeasurement z = measurement(t + t_O(k), t_O(k));
      for (int i = 0; i < 3; ++i) z.v_R(i) += 0.01 * wave(5 * k + i);
      if (k % 4 == 2) z.v_R.x() += 0.5;  // for the loss
      node.radar.push_back({z.stamp, pool.radarFactor(z, node.time)});
      if (k % 3 == 1) node.rest = pool.zeroVelocityFactor(3.0);
      if (k > 0) {
        const Time before = result.nodes.back().time;
        const StateBlock from = motion.state(t - 0.1);
        node.imu_from_previous =
            pool.imuFactor(preintegrate(imu, before, node.time, from.b_g(), from.b_a(), ImuNoise()));
        node.offset_from_previous = pool.offsetFactor(options.time_offset_noise * std::sqrt(0.1));
      }
      result.nodes.push_back(std::move(node));
    }
    return result;
  }
  Window window(const SmootherOptions& options, double t_O) const {
    return window(options, [=](int) { return t_O; });
  }

  /// With the means to solve a window.
  static std::vector<std::pair<const char*, Solve>> solvers() {
    return {{"chain", [](Window& w, const SolverLimits& limits) { return WindowSolver().solve(w, limits); }},
            {"ceres", [](Window& w, const SolverLimits& limits) { return solveWithCeres(w, limits); }}};
  }

  static SolverLimits tight() {
    SolverLimits limits;
    limits.max_iterations = 200;
    limits.short_step = 1e-6;
    return limits;
  }

  /// No t_O beyond the bound; no slope, but outwards along the t_O at it. How many stand at it.
  static int expectMinimum(const Window& window) {
    ChainSystem system;
    linearize(window, &system);
    int at_bound = 0;
    for (std::size_t k = 0; k < window.nodes.size(); ++k) {
      const double t_O = window.nodes[k].t_O;
      NodeVector slope = system.gradient[k].cwiseQuotient(system.diagonal[k].diagonal().cwiseSqrt());
      EXPECT_LE(std::abs(t_O), window.max_time_offset);
      if (std::abs(t_O) == window.max_time_offset) {
        EXPECT_LE(slope(StateBlock::kTangent) * t_O, 0.0) << "node " << k;
        slope(StateBlock::kTangent) = 0.0;
        ++at_bound;
      }
      EXPECT_LT(slope.norm(), 1e-3) << "node " << k;
    }
    return at_bound;
  }

  /// In marginal standard deviations.
  static void expectSameNodes(const Window& a, const Window& b, double sigmas) {
    ChainSystem system;
    linearize(a, &system);
    const std::vector<NodeMatrix> covariances = marginalCovariances(system);
    for (std::size_t k = 0; k < a.nodes.size(); ++k) {
      NodeVector apart;
      apart << boxminus(a.nodes[k].x.data(), b.nodes[k].x.data()), a.nodes[k].t_O - b.nodes[k].t_O;
      const NodeVector sigma = covariances[k].diagonal().cwiseSqrt();
      EXPECT_LT(apart.cwiseQuotient(sigma).cwiseAbs().maxCoeff(), sigmas) << "node " << k;
    }
  }
};

TEST_F(Windows, TheNormalEquationsAreThoseOfCeres) {
  for (const TimeOffsetModel model : {TimeOffsetModel::kConstantAcceleration, TimeOffsetModel::kImu}) {
    SmootherOptions options;
    options.time_offset_model = model;
    Window w = window(options, 0.01);
    int robust = 0, plain = 0;
    StateManifold manifold;
    ceres::Problem::Options borrowing;
    borrowing.cost_function_ownership = borrowing.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
#if RIO_T_CERES_HAS_MANIFOLD
    borrowing.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
#else
    borrowing.local_parameterization_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
#endif
    ceres::Problem problem(borrowing);
    ceres::Problem::EvaluateOptions order;
    for (WindowNode& node : w.nodes) {
      addStateBlock(problem, node.x.data(), manifold);
      problem.AddParameterBlock(&node.t_O, 1);
      order.parameter_blocks.push_back(node.x.data());
      order.parameter_blocks.push_back(&node.t_O);
    }
    problem.AddResidualBlock(w.prior.get(), nullptr, w.nodes[0].x.data(), &w.nodes[0].t_O);
    for (std::size_t k = 0; k < w.nodes.size(); ++k) {
      WindowNode& node = w.nodes[k];
      for (const RadarTerm& term : node.radar) {
        problem.AddResidualBlock(term.cost.get(), w.loss.get(), node.x.data(), &node.t_O);
        const double* blocks[] = {node.x.data(), &node.t_O};
        Eigen::Vector3d r;
        term.cost->Evaluate(blocks, r.data(), nullptr);
        ++(r.norm() > options.huber_threshold ? robust : plain);
      }
      if (node.rest) problem.AddResidualBlock(node.rest.get(), nullptr, node.x.data());
      if (k == 0) continue;
      WindowNode& previous = w.nodes[k - 1];
      problem.AddResidualBlock(node.imu_from_previous.get(), nullptr, previous.x.data(), node.x.data());
      problem.AddResidualBlock(node.offset_from_previous.get(), nullptr, &previous.t_O, &node.t_O);
    }
    EXPECT_GT(robust, 0);
    EXPECT_GT(plain, 0);
    double cost = 0.0;
    std::vector<double> gradient;
    ceres::CRSMatrix sparse;
    ASSERT_TRUE(problem.Evaluate(order, &cost, nullptr, &gradient, &sparse));
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(sparse.num_rows, sparse.num_cols);
    for (int row = 0; row < sparse.num_rows; ++row)
      for (int i = sparse.rows[row]; i < sparse.rows[row + 1]; ++i) J(row, sparse.cols[i]) = sparse.values[i];
    ASSERT_EQ(J.cols(), firstRow(kNodes));
    Eigen::MatrixXd H = J.transpose() * J;

    ChainSystem chain;
    linearize(w, &chain);
    EXPECT_NEAR(chain.cost, cost, 1e-12 * cost);
    const Eigen::VectorXd scale = H.diagonal().cwiseSqrt().cwiseInverse();
    const double size = scale.cwiseProduct(Eigen::Map<Eigen::VectorXd>(gradient.data(), J.cols())).norm();
    for (int k = 0; k < kNodes; ++k) {
      const Eigen::Index at = firstRow(k);
      for (int i = 0; i < kNodeTangent; ++i)
        EXPECT_NEAR(scale(at + i) * chain.gradient[k](i), scale(at + i) * gradient[at + i], 1e-10 * size);
      H.block<kNodeTangent, kNodeTangent>(at, at) -= chain.diagonal[k];
      if (k + 1 == kNodes) continue;
      H.block<kNodeTangent, kNodeTangent>(at, firstRow(k + 1)) -= chain.coupling[k];
      H.block<kNodeTangent, kNodeTangent>(firstRow(k + 1), at) -= chain.coupling[k].transpose();
    }
    EXPECT_LT((scale.asDiagonal() * H * scale.asDiagonal()).cwiseAbs().maxCoeff(), 1e-10);
  }
}

TEST_F(Windows, BothSolversFindTheMinimum) {
  const SmootherOptions options;
  Window chain = window(options, 0.05), ceres = window(options, 0.05);
  EXPECT_EQ(WindowSolver().solve(chain, tight()).termination, SolverTermination::kConverged);
  EXPECT_EQ(solveWithCeres(ceres, tight()).termination, SolverTermination::kConverged);
  EXPECT_EQ(expectMinimum(chain), 0);
  expectSameNodes(chain, ceres, 5e-3);
  EXPECT_NEAR(chain.nodes.back().t_O, 0.05, 5e-3);
}

TEST_F(Windows, AWrongJacobianIsNoConvergence) {
  for (const auto& [name, solve] : solvers()) {
    Window w = window(SmootherOptions(), 0.05);
    for (WindowNode& node : w.nodes)
      for (RadarTerm& term : node.radar) term.cost = std::make_unique<WrongSigned>(std::move(term.cost));
    const SolveReport report = solve(w, SolverLimits());
    EXPECT_EQ(report.termination, SolverTermination::kNoDecrease) << name;
    EXPECT_FALSE(report.converged()) << name;
  }
}

TEST_F(Windows, TooFewIterationsAreNoConvergence) {
  for (const auto& [name, solve] : solvers()) {
    Window w = window(SmootherOptions(), 0.05);
    SolverLimits limits;
    limits.max_iterations = 1;
    EXPECT_EQ(solve(w, limits).termination, SolverTermination::kIterationLimit) << name;
  }
}

TEST_F(Windows, AtItsBoundTheOffsetIsHeldAndTheRestIsSolved) {
  for (const double bound : {0.05, -0.05}) {
    for (const auto& [name, solve] : solvers()) {
      SmootherOptions options;
      options.max_time_offset = 0.05;
      options.time_offset_noise = 1e-6;
      Window w = window(options, 1.6 * bound);
      EXPECT_EQ(solve(w, SolverLimits()).termination, SolverTermination::kAtBound) << name;
      EXPECT_EQ(solve(w, tight()).termination, SolverTermination::kAtBound) << name;
      EXPECT_GT(expectMinimum(w), 0) << name;
      // The others stand where they would were the offset known to be the bound.
      options.time_offset_initial = bound;
      Window known = window(options, 1.6 * bound);
      known.offset_known = true;
      for (WindowNode& node : known.nodes) node.t_O = bound;
      EXPECT_EQ(solve(known, tight()).termination, SolverTermination::kConverged) << name;
      expectSameNodes(w, known, 5e-3);
    }
  }
}

TEST_F(Windows, TheOffsetLeavesABoundThatIsWidened) {
  for (const auto& [name, solve] : solvers()) {
    Window w = window(SmootherOptions(), 0.08);
    w.max_time_offset = 0.05;
    EXPECT_EQ(solve(w, SolverLimits()).termination, SolverTermination::kAtBound) << name;
    w.max_time_offset = 0.25;
    EXPECT_EQ(solve(w, SolverLimits()).termination, SolverTermination::kConverged) << name;
    EXPECT_NEAR(w.nodes.back().t_O, 0.08, 5e-3) << name;
  }
}

TEST_F(Windows, AnOffsetThatStartsAtTheBoundLeavesIt) {
  for (const auto& [name, solve] : solvers()) {
    SmootherOptions options;
    options.max_time_offset = 0.05;
    Window w = window(options, 0.02);
    for (WindowNode& node : w.nodes) node.t_O = 0.05;
    EXPECT_EQ(solve(w, SolverLimits()).termination, SolverTermination::kConverged) << name;
    EXPECT_NEAR(w.nodes.back().t_O, 0.02, 5e-3) << name;
  }
}

TEST_F(Windows, SomeOffsetsAtTheBoundAndSomeWithin) {
  for (const auto& [name, solve] : solvers()) {
    SmootherOptions options;
    options.max_time_offset = 0.05;
    options.time_offset_noise = 0.03;
    Window w = window(options, [](int k) { return 0.02 + 0.01 * k; });
    EXPECT_EQ(solve(w, tight()).termination, SolverTermination::kAtBound) << name;
    const int at_bound = expectMinimum(w);
    EXPECT_GT(at_bound, 1) << name;
    EXPECT_LT(at_bound, kNodes - 1) << name;
  }
}

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
      EXPECT_TRUE(smoother->optimize(1e-6).converged()) << "at " << stamp;
      smoother->marginalize();
    }
    const NodeEstimate a = chain.newest();
    const NodeEstimate b = ceres.newest();
    const NodeMatrix& P = ceres.newestCovariance();
    const NodeVector sigma = P.diagonal().cwiseSqrt();
    NodeVector difference;
    difference << boxminus(a.x.data(), b.x.data()), a.t_O - b.t_O;
    EXPECT_LT(difference.cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 5e-3) << "at " << stamp;
    EXPECT_LT(
        (chain.newestCovariance().diagonal().cwiseSqrt() - sigma).cwiseQuotient(sigma).cwiseAbs().maxCoeff(),
        1e-3)
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

TEST_F(Smoother, PredictsLateScansFromTheNodeBeforeThem) {
  SmootherOptions options;
  FixedLagSmoother smoother = make(options);
  for (double stamp = 0.7; stamp < 1.3; stamp += 0.1) {
    smoother.add(measurement(stamp, 0.0));
    smoother.optimize();
  }
  const RadarVelocityMeasurement late = measurement(0.95, 0.0);
  const auto prediction = smoother.predictRadarVelocity(late.stamp, late.R_RI, late.l_I);
  ASSERT_TRUE(prediction);
  EXPECT_LT((prediction->velocity.v_R - late.v_R).norm(), 0.02);
  EXPECT_LT(std::sqrt(prediction->velocity.covariance.trace()), 0.06);
  EXPECT_FALSE(smoother.predictRadarVelocity(motion.time(0.4), late.R_RI, late.l_I));
}

TEST_F(Smoother, AStepOfTheOffsetSurvivesANodeThatIsInsertedBeforeIt) {
  SmootherOptions options;
  options.window = 2.0;
  FixedLagSmoother smoother = make(options);
  const auto use = [&](double stamp, double t_O) {
    EXPECT_EQ(smoother.add(measurement(stamp, t_O)), FixedLagSmoother::AddResult::kAdded) << stamp;
    smoother.optimize();
  };
  for (double stamp = 0.7; stamp < 2.0; stamp += 0.1) use(stamp, 0.0);
  ASSERT_NEAR(smoother.newest().t_O, 0.0, 2e-3);
  // From 2.1 on stamps are 60 ms late. The first one is placed by the old offset.
  smoother.loosenTimeOffset(motion.time(2.1));
  use(2.1, 0.06);
  EXPECT_NEAR(smoother.newest().t_O, 0.06, 0.015);
  // A scan from before the step, late: between two nodes.
  use(1.95, 0.0);
  // One from behind it, measured before the node of the first.
  use(2.14, 0.06);
  use(2.2, 0.06);
  EXPECT_NEAR(smoother.newest().t_O, 0.06, 5e-3);
  for (std::size_t k = 0; k < smoother.size(); ++k) {
    if (smoother.node(k).time < motion.time(1.96)) {
      EXPECT_NEAR(smoother.node(k).t_O, 0.0, 5e-3) << k;
    }
  }
  // A new start knows of no step.
  smoother.loosenTimeOffset(motion.time(2.3));
  smoother.initialize(motion.time(2.5), priorAtRest(options, ImuNoise(), motion.state(2.5), 9.81, 3.0));
  use(2.6, 0.0);
  use(2.7, 0.0);
  const NodeMatrix& P = smoother.newestCovariance();
  EXPECT_LT(std::sqrt(P(StateBlock::kTangent, StateBlock::kTangent)), 0.5 * options.time_offset_sigma);
}

TEST(PriorAtRest, TiltAndBiasAreKnownTogether) {
  const SmootherOptions options;
  StateBlock x;
  x.q_WI() = so3::exp({0.4, -0.3, 0.9});
  const NodePrior prior = priorAtRest(options, ImuNoise(), x, 9.81, 3.0);
  const NodeMatrix P = (prior.J.transpose() * prior.J).inverse();
  const Eigen::Matrix3d R_WI = x.q_WI().toRotationMatrix();
  const Eigen::Matrix3d tilt = R_WI * P.topLeftCorner<3, 3>() * R_WI.transpose();
  // A tilt error is b_a / g.
  for (int i = 0; i < 2; ++i) EXPECT_NEAR(std::sqrt(tilt(i, i)), options.prior_sigma_accel_bias / 9.81, 3e-4);
  EXPECT_NEAR(std::sqrt(tilt(2, 2)), options.prior_sigma_yaw, 1e-6);
  // What the accelerometer reads is known by its noise, though neither of the two is.
  Eigen::Matrix<double, 3, kNodeTangent> J = Eigen::Matrix<double, 3, kNodeTangent>::Zero();
  J.leftCols<3>() = so3::hat(9.81 * R_WI.row(2).transpose());
  J.middleCols<3>(StateBlock::kBa).setIdentity();
  EXPECT_LT(std::sqrt((J * P * J.transpose()).trace() / 3.0), 0.02);
}

}  // namespace
}  // namespace rio_t
