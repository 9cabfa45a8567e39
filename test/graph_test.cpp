// The graph: its normal equations against Ceres, elimination, covariance and marginalisation against dense
// linear algebra, where it ends and why. And a sensor that nobody foresaw.
#include <ceres/crs_matrix.h>
#include <ceres/problem.h>
#include <ceres/sized_cost_function.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <memory>
#include <numeric>

#include "dense_system.h"
#include "radar_smoother.h"
#include "rio_t/factors/doppler_factor.h"
#include "rio_t/factors/imu_factor.h"
#include "rio_t/factors/random_walk_factor.h"
#include "rio_t/factors/zero_velocity_factor.h"
#include "rio_t/graph/marginalization.h"
#include "rio_t/graph/solver.h"
#include "rio_t/smoother/node_prior.h"

namespace rio_t {
namespace {

/// Numbers that add up.
class VectorManifold final : public Manifold {
 public:
  explicit VectorManifold(int n) : Manifold(n, upTo(n)) {}
  void plus(const double* x, const double* delta, double* x_plus_delta) const override {
    for (int i = 0; i < size(); ++i) x_plus_delta[i] = x[i] + delta[i];
  }
  Eigen::VectorXd minus(const double* y, const double* x) const override {
    return Eigen::Map<const Eigen::VectorXd>(y, size()) - Eigen::Map<const Eigen::VectorXd>(x, size());
  }
  Eigen::MatrixXd minusJacobian(const double*, const double*) const override {
    return Eigen::MatrixXd::Identity(size(), size());
  }

 private:
  static std::vector<int> upTo(int n) {
    std::vector<int> columns(static_cast<std::size_t>(n));
    std::iota(columns.begin(), columns.end(), 0);
    return columns;
  }
};

/// Residual sum of A_i x_i - b, with made-up A_i and b.
class LinearCost final : public ceres::CostFunction {
 public:
  LinearCost(int rows, const std::vector<int>& sizes, int seed) : b_(rows) {
    set_num_residuals(rows);
    *mutable_parameter_block_sizes() = std::vector<std::int32_t>(sizes.begin(), sizes.end());
    for (int i = 0; i < rows; ++i) b_(i) = wave(seed + 31 * i);
    for (const int size : sizes) {
      Eigen::Matrix<double, -1, -1, Eigen::RowMajor> A(rows, size);
      for (int i = 0; i < A.size(); ++i) A(i) = wave(seed = seed + 7 + i);
      A_.push_back(A);
    }
  }
  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    Eigen::Map<Eigen::VectorXd> r(residuals, num_residuals());
    r = -b_;
    for (std::size_t i = 0; i < A_.size(); ++i) {
      r += A_[i] * Eigen::Map<const Eigen::VectorXd>(x[i], A_[i].cols());
      if (jacobians == nullptr || jacobians[i] == nullptr) continue;
      std::copy(A_[i].data(), A_[i].data() + A_[i].size(), jacobians[i]);
    }
    return true;
  }

 private:
  Eigen::VectorXd b_;
  std::vector<Eigen::Matrix<double, -1, -1, Eigen::RowMajor>> A_;
};

/// Nodes of 3 numbers, calibration of 2, terms between neighbours and on the calibration. Linear.
struct LinearWindow {
  explicit LinearWindow(int count) {
    calibration = window.addCalibration(std::make_shared<VectorManifold>(2), Eigen::VectorXd::Zero(2));
    for (int k = 0; k < count; ++k) {
      nodes.push_back(&window.addNode(Time::fromSeconds(k), three, Eigen::VectorXd::Zero(3)));
      window.add(std::make_unique<LinearCost>(5, std::vector<int>{3, 2}, 100 * k),
                 {nodes.back(), calibration.get()});
      if (k > 0)
        window.add(std::make_unique<LinearCost>(4, std::vector<int>{3, 3}, 100 * k + 50),
                   {nodes[k - 1], nodes[k]});
    }
  }
  std::shared_ptr<const Manifold> three = std::make_shared<VectorManifold>(3);
  Window window;
  std::vector<Block*> nodes;
  std::shared_ptr<Block> calibration;
};

TEST(Elimination, SolvesLikeTheDenseSystem) {
  const LinearWindow linear(5);
  const LinearSystem system = linearize(linear.window);
  const Dense dense(system);
  const Eigen::VectorXd expected = dense.H.ldlt().solve(-dense.b);
  const auto elimination = Elimination::of(system);
  ASSERT_TRUE(elimination);
  for (std::size_t i = 0; i < dense.first.size(); ++i) {
    const Eigen::VectorXd& delta = elimination->delta()[i];
    EXPECT_LT((delta - expected.segment(dense.first[i], delta.size())).norm(), 1e-9 * expected.norm());
  }
  EXPECT_NEAR(elimination->squaredLength(), expected.dot(dense.H * expected),
              1e-9 * elimination->squaredLength());
}

TEST(Elimination, CovariancesAreThoseOfTheDenseInverse) {
  const LinearWindow linear(5);
  const LinearSystem system = linearize(linear.window);
  const Dense dense(system);
  const Eigen::MatrixXd inverse = dense.H.inverse();
  const auto elimination = Elimination::of(system);
  ASSERT_TRUE(elimination);
  // A node in the middle and the calibration.
  Eigen::MatrixXd expected(5, 5);
  const Eigen::Index a = dense.first[2], c = dense.first[5];
  expected << inverse.block(a, a, 3, 3), inverse.block(a, c, 3, 2), inverse.block(c, a, 2, 3),
      inverse.block(c, c, 2, 2);
  EXPECT_LT((elimination->covariance({2, 5}) - expected).norm(), 1e-9 * expected.norm());
  const auto all = elimination->covariances();
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (const auto& [j, P] : all[i])
      EXPECT_LT((P - inverse.block(dense.first[i], dense.first[j], P.rows(), P.cols())).norm(),
                1e-9 * inverse.norm());
  }
}

/// An outlier has hardly any derivative. Its square underflows.
TEST(Elimination, ATinyDerivativeCountsAsNone) {
  for (const double tiny : {1e-150, 1e-160, 1e-170, 1e-300}) {
    LinearWindow linear(5);
    LinearSystem system = linearize(linear.window);
    for (LinearRows& each : system.rows)
      if (each.blocks == std::vector<int>{0, 5} || each.blocks == std::vector<int>{1, 5})
        each.Jr.middleCols(3, 2) *= tiny;
    const Dense dense(system);
    const Eigen::VectorXd expected = dense.H.ldlt().solve(-dense.b);
    const auto elimination = Elimination::of(system);
    ASSERT_TRUE(elimination) << tiny;
    for (std::size_t i = 0; i < dense.first.size(); ++i) {
      const Eigen::VectorXd& delta = elimination->delta()[i];
      EXPECT_LT((delta - expected.segment(dense.first[i], delta.size())).norm(), 1e-9 * expected.norm())
          << tiny;
    }
  }
}

TEST(Elimination, WhatIsNotDeterminedIsRefused) {
  Window window;
  window.addNode(Time(), std::make_shared<VectorManifold>(3), Eigen::VectorXd::Zero(3));
  EXPECT_FALSE(Elimination::of(linearize(window)));
  EXPECT_THROW(solve(window, {}), std::runtime_error);
}

TEST(Marginalization, LeavesTheSolutionOfTheRest) {
  LinearWindow linear(5);
  const Eigen::MatrixXd before = linearized(linear.window).elimination.covariance({3, 4, 5});
  solve(linear.window, {});
  const Eigen::VectorXd newest = linear.nodes[4]->x, calibration = linear.calibration->x;
  for (Block* node : {linear.nodes[4], linear.nodes[3]})
    node->x.setConstant(0.7);  // it is linear: the point is free
  marginalize(linear.window, {linear.nodes[0]}, {});
  marginalize(linear.window, {linear.nodes[1], linear.nodes[2]}, {});
  ASSERT_EQ(linear.window.blocks().size(), 3U);
  EXPECT_EQ(linear.window.terms().size(), 4U);  // two nodes with the calibration, one between, one prior
  solve(linear.window, {});
  EXPECT_LT((linear.nodes[4]->x - newest).norm(), 1e-6 * newest.norm());
  EXPECT_LT((linear.calibration->x - calibration).norm(), 1e-6 * calibration.norm());
  EXPECT_LT((linearized(linear.window).elimination.covariance({0, 1, 2}) - before).norm(),
            1e-9 * before.norm());
}

TEST(Marginalization, AWalkWidensWhatThePriorSays) {
  // Two equal windows; in the second the walk is a block of its own.
  LinearWindow a(3), b(3);
  constexpr double kVariance = 0.3;
  marginalize(a.window, {a.nodes[0]}, {{a.calibration.get(), Eigen::VectorXd::Constant(2, kVariance)}});
  marginalize(b.window, {b.nodes[0]}, {});
  const Term* prior = b.window.terms().back().get();
  // The prior of b moves to a calibration before the walk.
  Dense dense(linearize({b.nodes[1], b.calibration.get()}, {prior}));
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(7, 7);
  H.topLeftCorner(5, 5) = dense.H;
  for (int i = 0; i < 2; ++i) {
    H(3 + i, 3 + i) += 1.0 / kVariance;
    H(5 + i, 5 + i) += 1.0 / kVariance;
    H(3 + i, 5 + i) = H(5 + i, 3 + i) = -1.0 / kVariance;
  }
  const Eigen::MatrixXd all = H.inverse();
  Eigen::MatrixXd expected(5, 5);
  expected << all.topLeftCorner(3, 3), all.topRightCorner(3, 2), all.bottomLeftCorner(2, 3),
      all.bottomRightCorner(2, 2);
  const Dense widened(linearize({a.nodes[1], a.calibration.get()}, {a.window.terms().back().get()}));
  EXPECT_LT((widened.H.inverse() - expected).norm(), 1e-6 * expected.norm());
}

TEST(Marginalization, KeepsWhatIsHardlyKnown) {
  // A chain of numbers. Only the first is observed, a billion times worse than each knows the next.
  Window window;
  const auto one = std::make_shared<VectorManifold>(1);
  constexpr double kSigma = 1e3, kStep = 1e-6;
  const auto root = [](std::vector<double> row) {
    return SquareRoot{Eigen::Map<Eigen::RowVectorXd>(row.data(), static_cast<Eigen::Index>(row.size())),
                      Eigen::VectorXd::Zero(1)};
  };
  Block* last = &window.addNode(Time(), one, Eigen::VectorXd::Zero(1));
  addPrior(window, {last}, root({1.0 / kSigma}));
  for (int k = 1; k < 3000; ++k) {
    Block& next = window.addNode(Time::fromSeconds(0.01 * k), one, Eigen::VectorXd::Zero(1));
    addPrior(window, {last, &next}, root({-1.0 / kStep, 1.0 / kStep}));
    marginalize(window, {last}, {});
    last = &next;
  }
  EXPECT_NEAR(std::sqrt(linearized(window).elimination.covariance({0})(0, 0)), kSigma, 1e-3 * kSigma);
}

TEST(SquareRoot, CompressedSaysTheSame) {
  SquareRoot rows{Eigen::MatrixXd(11, 8), Eigen::VectorXd(11)};
  for (int i = 0; i < rows.J.size(); ++i) rows.J(i) = wave(5 + i);
  rows.J.col(3) *= 1e6;  // as different as metres and biases
  for (int i = 0; i < rows.r0.size(); ++i) rows.r0(i) = wave(40 + i);
  const SquareRoot root = compressed(rows);
  ASSERT_EQ(root.J.rows(), 8);
  const Eigen::VectorXd scale = rows.J.colwise().norm().cwiseInverse();
  const Eigen::MatrixXd J = rows.J * scale.asDiagonal(), again = root.J * scale.asDiagonal();
  EXPECT_LT((again.transpose() * again - J.transpose() * J).norm(), 1e-12);
  EXPECT_LT((again.transpose() * root.r0 - J.transpose() * rows.r0).norm(), 1e-12);
}

TEST(SquareRoot, LeavesTheUnknownFree) {
  SquareRoot rows{Eigen::MatrixXd::Zero(6, 4), Eigen::VectorXd::Zero(6)};
  rows.J(1, 2) = 2.0;
  rows.r0(1) = 0.5;
  const SquareRoot root = compressed(rows);
  EXPECT_LT((root.J.transpose() * root.J - rows.J.transpose() * rows.J).norm(), 1e-12);
  EXPECT_LT((root.J.transpose() * root.r0 - rows.J.transpose() * rows.r0).norm(), 1e-12);
}

/// A window with every kind of factor, beside its minimum.
class Windows : public ::testing::TestWithParam<WindowSolver> {
 protected:
  static constexpr int kNodes = 9;

  Windows() : imu(motion.imu(0.0, 3.0, 400.0)) {}

  /// `t_O` [s] is the true offset, `start` where it begins.
  void make(double t_O, double bound = 0.25, double start = 0.0, bool wrong_sign = false,
            TimeOffsetModel kind = TimeOffsetModel::kImu, bool tightly = false) {
    window = Window();
    const auto manifold = std::make_shared<MotionManifold>();
    const StateBlock first = motion.state(0.5);
    biases =
        window.addCalibration(std::make_shared<VectorManifold>(StateBlock::kBiases), storedBiases(first));
    const auto loss = std::make_shared<ceres::HuberLoss>(1.5);
    const RadarMotionModel model{kind, bound, motion.g_W, &imu};
    offset = window.addCalibration(std::make_shared<VectorManifold>(1), Eigen::VectorXd::Constant(1, start));
    offset->bound = bound;
    SmootherOptions known;
    known.estimate_extrinsics = EstimateExtrinsics::kPose;
    known.extrinsics_rotation_sigma = known.extrinsics_translation_sigma = 0.01;
    extrinsics = window.addCalibration(std::make_shared<ExtrinsicsManifold>(known.estimate_extrinsics),
                                       stored(skewMounting()));
    Block* previous = nullptr;
    for (int k = 0; k < kNodes; ++k) {
      const double t = 0.5 + 0.1 * k;
      StateTangent beside;
      for (int i = 0; i < StateBlock::kTangent; ++i)
        beside(i) = (i < StateBlock::kBg ? 0.01 : 1e-3) * wave(17 * k + i);
      const StateBlock truth = motion.state(t);
      StateBlock x;
      boxplus(truth.data(), beside.data(), x.data());
      Block& node = window.addNode(motion.time(t), manifold, storedMotion(x));
      if (previous == nullptr) {
        const NodePrior prior = priorAtRest(known, ImuNoise(), truth, 9.81, 3.0, skewMounting());
        node.x = storedMotion(truth);
        offset->x[0] = 0.0;
        addPrior(window, {&node, biases.get(), offset.get(), extrinsics.get()}, prior.root);
        node.x = storedMotion(x);
        biases->x = storedBiases(x);
        offset->x[0] = start;
      } else {
        window.add(std::make_unique<ImuFactor>(
                       preintegrate(imu, *previous->time, *node.time, first.b_g(), first.b_a(), ImuNoise()),
                       motion.g_W),
                   {previous, &node, biases.get()});
      }
      RadarVelocityMeasurement z = radarMeasurement(motion, t + t_O, t_O);
      for (int i = 0; i < 3; ++i) z.v_R(i) += 0.01 * wave(5 * k + i);
      if (k % 4 == 2) z.v_R.x() += 0.5;  // for the loss
      if (tightly) {
        window.add(std::make_unique<DopplerFactor>(dopplers(z, k), *node.time, model),
                   {&node, biases.get(), offset.get(), extrinsics.get()});
        previous = &node;
        continue;
      }
      std::unique_ptr<ceres::CostFunction> cost = std::make_unique<RadarVelocityFactor>(z, *node.time, model);
      if (wrong_sign) cost = std::make_unique<WrongSigned>(std::move(cost));
      window.add(std::move(cost), {&node, biases.get(), offset.get(), extrinsics.get()}, loss);
      if (k % 3 == 1) window.add(std::make_unique<ZeroVelocityFactor>(3.0), {&node});
      previous = &node;
    }
  }

  /// Points that show the velocity; few in some scans, and one in ten anything.
  static DopplerMeasurement dopplers(const RadarVelocityMeasurement& z, int k) {
    PointVariances noise;
    noise.doppler = 0.03 * 0.03;
    noise.azimuth = noise.elevation = 0.03 * 0.03;
    noise.quantization = k % 2 == 0 ? 0.0 : 0.125 * 0.125 / 12.0;
    std::vector<RadarDirection> points;
    for (int i = 0; i < (k % 3 == 0 ? 2 : 25); ++i) {
      const Eigen::Vector3d u =
          Eigen::Vector3d(0.5 * wave(71 * k + i), 1.0, 0.4 * wave(13 * k + 7 * i)).normalized();
      const double error = i % 10 == 7 ? 1.5 : 0.03 * wave(29 * k + 3 * i);
      points.push_back({u, -u.dot(z.v_R) + error, static_cast<std::size_t>(i)});
    }
    DopplerMeasurement result;
    result.stamp = z.stamp;
    result.linear_from_t_O = 0.0;
    result.points = std::make_shared<DopplerLikelihood>(points, z.v_R, noise);
    result.shared_variances.setConstant(0.04 * 0.04);
    result.huber_threshold = 1.5;
    return result;
  }

  /// With the Jacobians of the wrong sign.
  class WrongSigned final : public ceres::SizedCostFunction<3, StateBlock::kMotion, StateBlock::kBiases, 1,
                                                            ExtrinsicsBlock::kSize> {
   public:
    explicit WrongSigned(std::unique_ptr<ceres::CostFunction> right) : right_(std::move(right)) {}
    bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
      if (!right_->Evaluate(parameters, residuals, jacobians)) return false;
      if (jacobians == nullptr) return true;
      if (jacobians[0] != nullptr) Eigen::Map<MotionJacobian<3>>{jacobians[0]} *= -1.0;
      if (jacobians[1] != nullptr) Eigen::Map<BiasJacobian<3>>{jacobians[1]} *= -1.0;
      if (jacobians[2] != nullptr) Eigen::Map<Eigen::Vector3d>{jacobians[2]} *= -1.0;
      return true;
    }

   private:
    std::unique_ptr<ceres::CostFunction> right_;
  };

  static constexpr SolverLimits kTight{200, 1e-6};

  /// Largest slope per standard deviation, but of the offset where it is at its bound.
  double slope() const {
    const LinearSystem system = linearize(window);
    const Dense dense(system);
    double largest = 0.0;
    for (std::size_t i = 0; i < system.blocks.size(); ++i) {
      if (system.blocks[i] == offset.get() && std::abs(offset->x[0]) == offset->bound) continue;
      const Eigen::VectorXd b = system.gradient(static_cast<int>(i));
      const Eigen::VectorXd squares = dense.H.diagonal().segment(dense.first[i], b.size());
      largest = std::max(largest, b.cwiseQuotient(squares.cwiseSqrt()).norm());
    }
    return largest;
  }

  SyntheticMotion motion;
  ImuBuffer imu;
  Window window;
  std::shared_ptr<Block> biases, offset, extrinsics;
};

TEST_P(Windows, TheLinearSystemIsThatOfCeres) {
  for (const TimeOffsetModel kind : {TimeOffsetModel::kConstantAcceleration, TimeOffsetModel::kImu}) {
    make(0.01, 0.25, 0.0, false, kind);
    ceres::Problem::EvaluateOptions order;
    for (const auto& block : window.blocks()) order.parameter_blocks.push_back(block->x.data());
    double cost = 0.0;
    std::vector<double> gradient;
    ceres::CRSMatrix sparse;
    ASSERT_TRUE(window.problem().Evaluate(order, &cost, nullptr, &gradient, &sparse));
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(sparse.num_rows, sparse.num_cols);
    for (int row = 0; row < sparse.num_rows; ++row)
      for (int i = sparse.rows[row]; i < sparse.rows[row + 1]; ++i) J(row, sparse.cols[i]) = sparse.values[i];
    const Eigen::MatrixXd H = J.transpose() * J;
    const Eigen::Map<const Eigen::VectorXd> b(gradient.data(), J.cols());

    const LinearSystem system = linearize(window);
    const Dense dense(system);
    EXPECT_NEAR(system.cost, cost, 1e-12 * cost);
    ASSERT_EQ(dense.H.rows(), H.rows());
    const Eigen::VectorXd scale = H.diagonal().cwiseSqrt().cwiseInverse();
    EXPECT_LT((scale.asDiagonal() * (dense.H - H) * scale.asDiagonal()).cwiseAbs().maxCoeff(), 1e-10);
    EXPECT_LT(scale.cwiseProduct(dense.b - b).norm(), 1e-10 * scale.cwiseProduct(b).norm());
  }
}

TEST(Solve, ALinearWindowIsSolvedAtOnceAndIsNotLookedAtAgain) {
  LinearWindow linear(6);
  solve(linear.window, SolverLimits());
  linear.window.blocks().front()->x[0] += 0.2;  // less than a sigma
  const double away = linearized(linear.window).elimination.squaredLength();
  ASSERT_GT(away, 10.0 * SolverLimits().short_step);
  ASSERT_LT(away, 1.0);
  const Solution solution = solve(linear.window, SolverLimits());
  EXPECT_EQ(solution.termination, SolverTermination::kConverged);
  EXPECT_EQ(solution.iterations, 1);
  EXPECT_LT(linearized(linear.window).elimination.squaredLength(), 1e-18);
}

TEST_P(Windows, FindsTheMinimum) {
  make(0.05);
  EXPECT_EQ(solve(window, kTight, GetParam()).termination, SolverTermination::kConverged);
  EXPECT_LT(slope(), 1e-3);
  EXPECT_NEAR(offset->x[0], 0.05, 5e-3);
}

TEST_P(Windows, FindsTheMinimumOfDopplers) {
  make(0.03, 0.25, 0.0, false, TimeOffsetModel::kImu, true);
  // Outliers and bins have no Gauss-Newton that converges quadratically: to a hundredth of a sigma.
  EXPECT_EQ(solve(window, {200, 1e-4}, GetParam()).termination, SolverTermination::kConverged);
  EXPECT_LT(slope(), 0.02);
}

TEST_P(Windows, SaysTheSameOfDopplersAsTheOtherSolver) {
  std::vector<Eigen::VectorXd> found[2];
  const WindowSolver other = GetParam() == WindowSolver::kChain ? WindowSolver::kCeres : WindowSolver::kChain;
  for (const WindowSolver solver : {GetParam(), other}) {
    make(0.03, 0.25, 0.0, false, TimeOffsetModel::kImu, true);
    EXPECT_TRUE(solve(window, {200, 1e-4}, solver).converged());
    for (const auto& block : window.blocks()) found[solver == other].emplace_back(block->x);
  }
  // The velocities have a sigma of 1 cm/s and more.
  ASSERT_EQ(found[0].size(), found[1].size());
  for (std::size_t i = 0; i < found[0].size(); ++i)
    EXPECT_LT((found[0][i] - found[1][i]).norm(), 1e-3) << "block " << i;
}

TEST_P(Windows, AfterConvergenceNoLongStepIsLeft) {
  for (const bool tightly : {false, true}) {
    for (const double t_O : {0.0, 0.03, 0.1}) {
      make(t_O, 0.25, 0.0, false, TimeOffsetModel::kImu, tightly);
      EXPECT_TRUE(solve(window, SolverLimits(), GetParam()).converged());
      EXPECT_LT(linearized(window).elimination.squaredLength(), SolverLimits().short_step)
          << "tightly " << tightly << ", " << t_O << " s";
    }
  }
}

TEST_P(Windows, AWrongJacobianIsNoConvergence) {
  make(0.05, 0.25, 0.0, true);
  const Solution solution = solve(window, SolverLimits(), GetParam());
  EXPECT_EQ(solution.termination, SolverTermination::kNoDecrease);
  EXPECT_FALSE(solution.converged());
}

TEST_P(Windows, TooFewIterationsAreNoConvergence) {
  make(0.05);
  EXPECT_EQ(solve(window, {1, 1e-2}, GetParam()).termination, SolverTermination::kIterationLimit);
}

TEST_P(Windows, AtItsBoundTheOffsetIsHeldAndTheRestIsSolved) {
  for (const double bound : {0.05, -0.05}) {
    make(1.6 * bound, 0.05);
    EXPECT_EQ(solve(window, SolverLimits(), GetParam()).termination, SolverTermination::kAtBound);
    EXPECT_EQ(solve(window, kTight, GetParam()).termination, SolverTermination::kAtBound);
    EXPECT_EQ(offset->x[0], bound);
    EXPECT_FALSE(offset->is_constant) << "the next scan may free it";
    EXPECT_LT(slope(), 1e-3);
    const Eigen::VectorXd newest = window.blocks()[kNodes - 1]->x;
    // The others stand where they would were the offset known to be the bound.
    make(1.6 * bound, 0.05, bound);
    window.setConstant(*offset, true);
    EXPECT_EQ(solve(window, kTight, GetParam()).termination, SolverTermination::kConverged);
    EXPECT_LT((window.blocks()[kNodes - 1]->x - newest).norm(), 1e-4);
  }
}

TEST_P(Windows, TheOffsetLeavesABoundThatIsWidened) {
  make(0.08, 0.05);
  EXPECT_EQ(solve(window, SolverLimits(), GetParam()).termination, SolverTermination::kAtBound);
  make(0.08, 0.25, 0.05);
  EXPECT_EQ(solve(window, SolverLimits(), GetParam()).termination, SolverTermination::kConverged);
  EXPECT_NEAR(offset->x[0], 0.08, 5e-3);
}

TEST_P(Windows, AnOffsetThatStartsAtTheBoundLeavesIt) {
  make(0.02, 0.05, 0.05);
  EXPECT_EQ(solve(window, SolverLimits(), GetParam()).termination, SolverTermination::kConverged);
  EXPECT_NEAR(offset->x[0], 0.02, 5e-3);
}

INSTANTIATE_TEST_SUITE_P(Solver, Windows, ::testing::Values(WindowSolver::kChain, WindowSolver::kCeres),
                         [](const auto& solver) {
                           return solver.param == WindowSolver::kChain ? "chain" : "ceres";
                         });

/// A height above the start, off by a bias that is calibrated: z - (p_W,z + bias), whitened. Blocks: motion,
/// bias. All that a new sensor needs: this cost function, and where it is added to the window.
class AltimeterFactor final : public ceres::SizedCostFunction<1, StateBlock::kMotion, 1> {
 public:
  AltimeterFactor(double height, double sigma) : height_(height), weight_(1.0 / sigma) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    residuals[0] = weight_ * (MotionView(parameters[0]).p_W.z() + parameters[1][0] - height_);
    if (jacobians == nullptr) return true;
    if (jacobians[0] != nullptr) {
      Eigen::Map<MotionJacobian<1>> J(jacobians[0]);
      J.setZero();
      J(StateBlock::kPStored + 2) = weight_;
    }
    if (jacobians[1] != nullptr) jacobians[1][0] = weight_;
    return true;
  }

 private:
  double height_, weight_;
};

TEST(AddASensor, AnAltimeterNeedsAFactorAndABlock) {
  const SyntheticMotion motion;
  const ImuBuffer imu = motion.imu(0.0, 8.5, 400.0);
  const SmootherOptions options;
  double sigma_without = 0.0;
  for (const bool with_altimeter : {false, true}) {
    RadarSmoother smoother(options, skewMounting(), motion.g_W, imu);
    smoother.initialize(motion.time(0.5),
                        priorAtRest(options, ImuNoise(), motion.state(0.5), 9.81, 3.0, skewMounting()));
    Window& window = smoother.states.window();
    const auto bias = window.addCalibration(std::make_shared<VectorManifold>(1), Eigen::VectorXd::Zero(1));
    // 1 m is known of it beforehand.
    addPrior(window, {bias.get()}, {Eigen::MatrixXd::Identity(1, 1), Eigen::VectorXd::Zero(1)});
    smoother.states.settle();
    for (int k = 0; k < 70; ++k) {
      const double stamp = 0.7 + 0.1 * k;
      ASSERT_TRUE(smoother.add(radarMeasurement(motion, stamp, 0.0)));
      if (with_altimeter) {
        Block* node = smoother.states.nodeAt(motion.time(stamp));
        window.add(std::make_unique<AltimeterFactor>(motion.p_W(stamp).z() + 0.4, 1e-3), {node, bias.get()});
      }
      smoother.optimize();
      smoother.marginalize();
    }
    const double sigma = std::sqrt(smoother.newestCovariance()(StateBlock::kP + 2, StateBlock::kP + 2));
    if (!with_altimeter) {
      sigma_without = sigma;
      continue;
    }
    // It also outlives marginalisation: the bias stays what the first heights said.
    EXPECT_NEAR(bias->x[0], 0.4, 3e-3);
    EXPECT_LT(sigma, 0.5 * sigma_without);
    EXPECT_NEAR(smoother.newest().x.p_W().z(), motion.p_W(smoother.newest().time - motion.start).z(), 3e-3);
  }
}

}  // namespace
}  // namespace rio_t
