// The graph: its normal equations against Ceres, where a solve ends and why. And a sensor that nobody
// foresaw.
#include <ceres/crs_matrix.h>
#include <ceres/problem.h>
#include <ceres/sized_cost_function.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <memory>

#include "dense_system.h"
#include "linear_window.h"
#include "noise.h"
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
    known.extrinsics_rotation_sigma = 0.01;
    CalibrationPrior configured{skewMounting()};
    configured.extrinsics_translation_sigma = 0.01;
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
        const NodePrior prior = priorAtRest(known, ImuNoise(), truth, 9.81, 3.0, configured);
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
    result.linear_from_t_O = std::make_shared<const double>(0.0);
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

void expectLinearSystemOfCeres(Window& window) {
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

TEST_P(Windows, TheLinearSystemIsThatOfCeres) {
  for (const TimeOffsetModel kind : {TimeOffsetModel::kConstantAcceleration, TimeOffsetModel::kImu}) {
    make(0.01, 0.25, 0.0, false, kind);
    expectLinearSystemOfCeres(window);
  }
}

TEST_P(Windows, ATermTakesAnotherBlockForBoth) {
  make(0.01);
  const auto other = window.addCalibration(offset->manifold, Eigen::VectorXd::Constant(1, 0.02));
  Term& last = *window.terms().back();
  const std::size_t terms = window.terms().size();
  window.exchange(last, *offset, *other);
  EXPECT_EQ(window.terms().size(), terms);
  EXPECT_EQ(last.blocks[2], other.get());
  EXPECT_EQ(last.blocks[1], biases.get());
  expectLinearSystemOfCeres(window);
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
  const double before = costOf(window);
  const Solution solution = solve(window, {1, 1e-2}, GetParam());
  EXPECT_EQ(solution.termination, SolverTermination::kIterationLimit);
  EXPECT_EQ(solution.iterations, 1);
  EXPECT_LT(costOf(window), 0.5 * before) << "one iteration is one step";
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
    RadarSmoother smoother(options, {skewMounting()}, motion.g_W, imu);
    smoother.initialize(motion.time(0.5),
                        priorAtRest(options, ImuNoise(), motion.state(0.5), 9.81, 3.0, {skewMounting()}));
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
