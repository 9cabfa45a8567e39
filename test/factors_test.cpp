// Every factor: analytic Jacobians against numeric ones on the manifold, and residuals that are zero at the
// truth.
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "factor_setup.h"
#include "noise.h"
#include "numeric_jacobian.h"
#include "rio_t/core/so3.h"
#include "rio_t/factors/imu_factor.h"
#include "rio_t/factors/motion_manifold.h"
#include "rio_t/factors/radar_motion.h"
#include "rio_t/factors/radar_velocity_factor.h"
#include "rio_t/factors/random_walk_factor.h"
#include "rio_t/factors/zero_velocity_factor.h"
#include "rio_t/graph/marginalization.h"
#include "rio_t/smoother/fixed_lag_smoother.h"
#include "synthetic_motion.h"

namespace rio_t {
namespace {

TEST(ImuFactor, JacobiansAreCorrect) {
  const SyntheticMotion motion;
  const ImuBuffer imu = motion.imu(0.9, 1.3, 400.0);
  const StateBlock x_i = motion.state(1.0);
  const Preintegration pre =
      preintegrate(imu, motion.time(1.0), motion.time(1.1), x_i.b_g() + Eigen::Vector3d(1e-3, 2e-3, -1e-3),
                   x_i.b_a(), ImuNoise());
  const ImuFactor factor(pre, motion.g_W);
  const StateBlock near = moved(x_i, 0.1);
  expectJacobiansCorrect(factor, {motionOf(near), motionOf(moved(motion.state(1.1), -0.2)), biasesOf(near)},
                         1e-6, 1e-4);
}

TEST(ImuFactor, ResidualIsZeroAtTheTruth) {
  const SyntheticMotion motion;
  const ImuBuffer imu = motion.imu(0.9, 1.3, 2000.0);
  const StateBlock x_i = motion.state(1.0);
  const Preintegration pre =
      preintegrate(imu, motion.time(1.0), motion.time(1.1), x_i.b_g(), x_i.b_a(), ImuNoise());
  const StateBlock x_j = predict(x_i, pre.delta, motion.g_W);
  EXPECT_LT(boxminus(x_j.data(), motion.state(1.1).data()).norm(), 2e-6);
  Eigen::Matrix<double, 9, 1> r;
  const double* blocks[] = {x_i.data(), x_j.data(), x_i.biases()};
  ImuFactor(pre, motion.g_W).Evaluate(blocks, r.data(), nullptr);
  EXPECT_LT(r.norm(), 1e-7);
}

TEST(ImuFactor, TransitionSaysTheSameAsTheFactor) {
  const SyntheticMotion motion;
  const ImuBuffer imu = motion.imu(0.9, 1.3, 400.0);
  const StateBlock x_i = motion.state(1.0);
  const Preintegration pre =
      preintegrate(imu, motion.time(1.0), motion.time(1.1), x_i.b_g(), x_i.b_a(), ImuNoise());
  const ImuTransition step = transition(x_i, pre);

  // A against central differences of the prediction, on the manifold.
  const StateBlock x_j = predict(x_i, pre.delta, motion.g_W);
  Eigen::Matrix<double, StateBlock::kMotionTangent, StateBlock::kTangent> numeric;
  for (int i = 0; i < StateBlock::kTangent; ++i) {
    StateTangent end[2];
    for (const double h : {-1e-5, 1e-5}) {
      StateTangent delta = StateTangent::Zero();
      delta(i) = h;
      StateBlock x;
      boxplus(x_i.data(), delta.data(), x.data());
      end[h > 0] =
          boxminus(carried(x, motion.time(1.0), motion.time(1.1), imu, motion.g_W).data(), x_j.data());
    }
    numeric.col(i) = (end[1] - end[0]).head<StateBlock::kMotionTangent>() / 2e-5;
  }
  EXPECT_LT((step.A - numeric).cwiseAbs().maxCoeff(), 1e-7);

  // The factor: J_i d_i + J_j d_j ~ N(0, 1), where d_i has the biases.
  const double* blocks[] = {x_i.data(), x_j.data(), x_i.biases()};
  MotionJacobian<9> J_i, J_j;
  BiasJacobian<9> J_b;
  double* jacobians[] = {J_i.data(), J_j.data(), J_b.data()};
  Eigen::Matrix<double, 9, 1> r;
  ImuFactor(pre, motion.g_W).Evaluate(blocks, r.data(), jacobians);
  Eigen::Matrix<double, 9, 15> T_i;
  Eigen::Matrix<double, 9, 9> T_j;
  T_i << J_i.leftCols<3>(), J_i.rightCols<6>(), J_b;
  T_j << J_j.leftCols<3>(), J_j.rightCols<6>();
  const Eigen::Matrix<double, 9, 9> whitened_Q = T_j * step.Q * T_j.transpose();
  EXPECT_LT((whitened_Q - Eigen::Matrix<double, 9, 9>::Identity()).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT((T_i + T_j * step.A).norm(), 1e-6 * T_i.norm());
}

RadarMotionModel constantAcceleration(const ImuBuffer& imu) {
  return {TimeOffsetModel::kConstantAcceleration, 0.25, SyntheticMotion().g_W, &imu};
}

TEST(ConstantAccelerationRadarFactor, JacobiansAreCorrect) {
  const SyntheticMotion motion;
  const ImuBuffer imu = motion.imu(0.9, 1.3, 400.0);
  const RadarVelocityFactor factor(measurement(motion.time(1.0)), motion.time(1.0),
                                   constantAcceleration(imu));
  const StateBlock x = moved(motion.state(1.0), 0.1);
  expectJacobiansCorrect(factor, {motionOf(x), biasesOf(x), {0.04}, storedMounting()});
}

TEST(ConstantAccelerationRadarFactor, SaysTheSameWithAndWithoutJacobians) {
  const SyntheticMotion motion;
  const ImuBuffer imu = motion.imu(0.5, 1.6, 400.0);
  RadarVelocityMeasurement z = measurement(motion.time(1.0));
  z.offset_half_width = 0.4;
  const RadarVelocityFactor factor(z, motion.time(1.0), constantAcceleration(imu));
  const StateBlock x = moved(motion.state(1.0), 0.1);
  const double t_O = 0.1;
  const double* blocks[] = {x.data(), x.biases(), &t_O, storedMounting().data()};
  Eigen::Vector3d alone, r;
  MotionJacobian<3> J;
  double* jacobians[] = {J.data(), nullptr, nullptr, nullptr};
  factor.Evaluate(blocks, alone.data(), nullptr);
  factor.Evaluate(blocks, r.data(), jacobians);
  EXPECT_LT((alone - r).norm(), 1e-12);
}

TEST(ConstantAccelerationRadarFactor, AtRestTheCorrectedAccelerationIsZero) {
  // The sign of gravity: a level accelerometer at rest reads +g, so the offset must not matter.
  RadarVelocityMeasurement z = measurement(Time::fromSeconds(1.0));
  z.v_R.setZero();
  ImuBuffer imu;
  for (const double t : {0.9, 1.1})
    imu.add({Time::fromSeconds(t), Eigen::Vector3d::Zero(), Eigen::Vector3d(0.0, 0.0, 9.81)});
  const StateBlock x;
  const double t_O = 0.1;
  const double* blocks[] = {x.data(), x.biases(), &t_O, storedMounting().data()};
  Eigen::Vector3d r;
  RadarVelocityFactor(z, z.stamp, constantAcceleration(imu)).Evaluate(blocks, r.data(), nullptr);
  EXPECT_LT(r.norm(), 1e-12);
}

TEST(ImuRadarFactor, JacobiansAreCorrectForwardsAndBackwards) {
  const SyntheticMotion motion;
  const ImuBuffer imu = motion.imu(0.5, 1.6, 400.0);
  for (const double t_O : {-0.11, -0.0113, 0.0037, 0.0521, 0.2031}) {
    // Without a part of t_O in it, the derivatives in the state are exact.
    RadarVelocityMeasurement z = measurement(motion.time(1.0));
    z.linear_from_t_O = std::make_shared<const double>(t_O);
    z.offset_gain = 0.0;
    const StateBlock x = moved(motion.state(0.98), 0.05);
    expectJacobiansCorrect(RadarVelocityFactor(z, motion.time(0.98), imuModel(imu)),
                           {motionOf(x), biasesOf(x), {0.2 - t_O}, storedMounting()}, 1e-6, 1e-4);
  }
}

TEST(ImuRadarFactor, TheDerivativeInTheExtrinsicsIsExactAwayFromWhereTheScanWasPlaced) {
  const SyntheticMotion motion;
  const ImuBuffer imu = motion.imu(0.5, 1.6, 400.0);
  const StateBlock x = moved(motion.state(0.98), 0.05);
  RadarVelocityMeasurement z = measurement(motion.time(1.0));
  z.linear_from_t_O = std::make_shared<const double>(0.02);
  z.offset_gain = 0.6;
  const RadarVelocityFactor factor(z, motion.time(0.98), imuModel(imu));
  const ExtrinsicsManifold manifold(EstimateExtrinsics::kPose);
  const double t_O = 0.1;
  const auto residual = [&](const std::vector<double>& T_IR, double** jacobians = nullptr) {
    const double* blocks[] = {x.data(), x.biases(), &t_O, T_IR.data()};
    Eigen::Vector3d r;
    factor.Evaluate(blocks, r.data(), jacobians);
    return r;
  };
  ExtrinsicsJacobian<3> J;
  double* jacobians[] = {nullptr, nullptr, nullptr, J.data()};
  residual(storedMounting(), jacobians);
  constexpr double h = 1e-6;
  for (int i = 0; i < manifold.tangent(); ++i) {
    std::vector<double> ends[2] = {storedMounting(), storedMounting()};
    for (const int side : {0, 1}) {
      const Eigen::VectorXd delta = (side == 0 ? -h : h) * Eigen::VectorXd::Unit(manifold.tangent(), i);
      manifold.plus(ends[side].data(), delta.data(), ends[side].data());
    }
    const Eigen::Vector3d numeric = (residual(ends[1]) - residual(ends[0])) / (2.0 * h);
    EXPECT_LT((J.col(manifold.columns()[static_cast<std::size_t>(i)]) - numeric).norm(), 1e-6 * J.norm())
        << i;
  }
}

TEST(ImuRadarFactor, TheMountingCountsToFirstOrderFromWhereItIsLinear) {
  const SyntheticMotion motion;
  const ImuBuffer imu = motion.imu(0.5, 1.6, 400.0);
  RadarVelocityMeasurement z = measurement(motion.time(1.0));
  const StateBlock x = moved(motion.state(0.98), 0.05);
  const auto residual = [&](const std::vector<double>& T_IR) {
    const double t_O = 0.02;
    const double* blocks[] = {x.data(), x.biases(), &t_O, T_IR.data()};
    Eigen::Vector3d r;
    RadarVelocityFactor(z, motion.time(0.98), imuModel(imu)).Evaluate(blocks, r.data(), nullptr);
    return r;
  };
  const Eigen::Vector3d exact = residual(storedMounting());
  z.linear_from_t_O = std::make_shared<const double>(0.02);
  z.offset_gain = 0.6;
  // Its mean motion is another one than that of the state.
  z.slow = std::make_shared<SlowMotion>(SlowMotion{mounting(), {0.4, 0.9, -0.3}, {0.2, -0.5, 0.7}});
  EXPECT_LT((residual(storedMounting()) - exact).norm(), 1e-12);

  std::vector<double> turned = storedMounting();
  Eigen::VectorXd delta(6);
  delta << 0.1, -0.2, 0.15, 0.05, 0.02, -0.03;
  ExtrinsicsManifold(EstimateExtrinsics::kPose).plus(turned.data(), delta.data(), turned.data());
  expectJacobiansCorrect(RadarVelocityFactor(z, motion.time(0.98), imuModel(imu)),
                         {motionOf(x), biasesOf(x), {0.02}, turned}, 1e-6, 1e-4);
}

TEST(ImuRadarFactor, TheDerivativeInTheOffsetIsThatOverItsWindow) {
  const SyntheticMotion motion;
  const ImuBuffer imu = motion.imu(0.5, 1.6, 400.0);
  const StateBlock x = moved(motion.state(0.98), 0.05);
  for (const double t_O : {-0.11, -0.0113, 0.0037, 0.0521, 0.1731}) {
    const RadarVelocityFactor factor(measurement(motion.time(1.0)), motion.time(0.98), imuModel(imu, 0.5));
    const auto residual = [&](double offset, double** jacobians = nullptr) {
      const double* blocks[] = {x.data(), x.biases(), &offset, storedMounting().data()};
      Eigen::Vector3d r;
      factor.Evaluate(blocks, r.data(), jacobians);
      return r;
    };
    Eigen::Vector3d J_t;
    double* jacobians[] = {nullptr, nullptr, J_t.data(), nullptr};
    residual(t_O, jacobians);
    // The derivative of the mean with weights that fall linearly: from the mean of one side to that of the
    // other.
    constexpr int kSteps = 50;
    Eigen::Vector3d expected = Eigen::Vector3d::Zero();
    for (int i = 0; i < kSteps; ++i) {
      const double away = kOffsetHalfWidth * (i + 0.5) / kSteps;
      expected += (residual(t_O + away) - residual(t_O - away)) / (kSteps * kOffsetHalfWidth);
    }
    // The rotation within the window is of second order in its width.
    EXPECT_LT((J_t - expected).norm(), 1e-2 * J_t.norm()) << t_O;
  }
}

TEST(ImuRadarFactor, AHeldOffsetIsAllThatCounts) {
  const SyntheticMotion motion;
  const ImuBuffer imu = motion.imu(0.5, 1.6, 400.0);
  RadarVelocityMeasurement z = measurement(motion.time(1.0));
  const StateBlock x = motion.state(0.98);
  const auto residual = [&](double t_O) {
    const double* blocks[] = {x.data(), x.biases(), &t_O, storedMounting().data()};
    Eigen::Vector3d r;
    RadarVelocityFactor(z, motion.time(0.98), imuModel(imu)).Evaluate(blocks, r.data(), nullptr);
    return r;
  };
  const Eigen::Vector3d free = residual(0.02);
  z.linear_from_t_O = std::make_shared<const double>(0.02);
  z.offset_gain = 0.0;
  EXPECT_EQ(residual(0.02), free);
  EXPECT_EQ(residual(-0.1), free);
}

TEST(ImuRadarFactor, AroundWhereAScanWasPlacedTheOffsetCountsToFirstOrder) {
  const SyntheticMotion motion;
  const ImuBuffer imu = motion.imu(0.5, 1.6, 400.0);
  const StateBlock x = moved(motion.state(0.98), 0.05);
  for (const double gain : {1.0, 0.4}) {
    RadarVelocityMeasurement z = measurement(motion.time(1.0));
    z.linear_from_t_O = std::make_shared<const double>(0.02);
    z.offset_gain = gain;
    const RadarVelocityFactor factor(z, motion.time(0.98), imuModel(imu));
    z.linear_from_t_O = nullptr;
    const RadarVelocityFactor exact(z, motion.time(0.98), imuModel(imu));
    const auto residual = [&](const RadarVelocityFactor& f, double t_O, Eigen::Vector3d* J_t = nullptr) {
      const double* blocks[] = {x.data(), x.biases(), &t_O, storedMounting().data()};
      double* jacobians[] = {nullptr, nullptr, J_t != nullptr ? J_t->data() : nullptr, nullptr};
      Eigen::Vector3d r;
      f.Evaluate(blocks, r.data(), J_t != nullptr ? jacobians : nullptr);
      return r;
    };
    Eigen::Vector3d J_t, J_exact, J_away;
    const Eigen::Vector3d r = residual(factor, 0.02, &J_t);
    EXPECT_EQ(r, residual(exact, 0.02, &J_exact));
    EXPECT_EQ(J_t, J_exact);
    EXPECT_GT(J_t.norm(), 1.0);
    for (const double t_O : {-0.15, 0.01, 0.021, 0.2}) {
      // Whether the derivative is asked for or not.
      EXPECT_LT((residual(factor, t_O) - (r + (t_O - 0.02) * J_t)).norm(), 1e-9) << t_O;
      EXPECT_LT((residual(factor, t_O, &J_away) - (r + (t_O - 0.02) * J_t)).norm(), 1e-9) << t_O;
      EXPECT_EQ(J_away, J_t) << t_O;
    }
    EXPECT_GT((residual(exact, 0.2) - (r + 0.18 * J_t)).norm(), 0.1);  // there is something to leave out
  }
}

TEST(VelocityRate, ClaimsTheScatterThatTheNoiseOfTheImuGivesIt) {
  constexpr double kSpacing = 0.01;  // [s]
  constexpr double kDensity = 4e-3;  // squared
  for (const double half_width : kOffsetHalfWidths) {
    Noise noise;
    double squares = 0.0;
    constexpr int kRuns = 1000;
    for (int run = 0; run < kRuns; ++run) {
      ImuBuffer imu;
      for (int i = 0; i <= 120; ++i) {
        ImuMeasurement sample{
            Time::fromSeconds(kSpacing * i), Eigen::Vector3d::Zero(),
            Eigen::Vector3d(0.0, 0.0, 9.81) + std::sqrt(kDensity / kSpacing) * noise.vector()};
        sample.accel_noise = kDensity;
        imu.add(sample);
      }
      const Time middle = Time::fromSeconds(0.6);
      const VelocityRate rate =
          velocityRate(imu.mean(middle, half_width), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                       Eigen::Vector3d::Zero(), Eigen::Vector3d(0.0, 0.0, -9.81), Eigen::Vector3d::Zero());
      squares += rate.a_I.squaredNorm() / rate.variance / (3 * kRuns);
    }
    EXPECT_NEAR(squares, 1.0, 0.1) << half_width;
  }
}

TEST(ImuRadarFactor, ResidualIsZeroAtTheTrueOffset) {
  const SyntheticMotion motion;
  const ImuBuffer imu = motion.imu(0.5, 1.6, 400.0);
  for (const double t_O : {-0.1, 0.0, 0.03, 0.2}) {
    RadarVelocityMeasurement z = measurement(motion.time(1.0));
    z.v_R = motion.radarVelocity(1.0 - t_O, mounting().R_RI(), mounting().l_I);
    z.covariance.setIdentity();
    const StateBlock x = motion.state(1.02);
    const double* blocks[] = {x.data(), x.biases(), &t_O, storedMounting().data()};
    Eigen::Vector3d r;
    RadarVelocityFactor(z, motion.time(1.02), imuModel(imu)).Evaluate(blocks, r.data(), nullptr);
    EXPECT_LT(r.norm(), 1e-4) << "offset " << t_O;
  }
}

TEST(RandomWalkFactor, JacobiansAreCorrect) {
  expectJacobiansCorrect(RandomWalkFactor(Eigen::Vector2d(3e-3, 0.1)), {{0.01, 0.3}, {-0.02, 0.2}}, 1e-6,
                         1e-3);
}

TEST(ZeroVelocityFactor, JacobiansAreCorrect) {
  expectJacobiansCorrect(ZeroVelocityFactor(0.05), {motionOf(moved(SyntheticMotion().state(1.0), 0.1))});
}

TEST(PriorTerm, JacobiansAreCorrect) {
  const StateBlock x0 = SyntheticMotion().state(1.0);
  SquareRoot root{Eigen::MatrixXd(10, 10), Eigen::VectorXd(10)};
  for (int i = 0; i < 10; ++i) {
    root.r0(i) = std::sin(0.7 * i);
    for (int j = 0; j < 10; ++j) root.J(i, j) = std::sin(1.0 + 3.1 * i + 1.7 * j);
  }
  const PriorTerm prior({std::make_shared<MotionManifold>(), std::make_shared<VectorManifold>(1)},
                        {storedMotion(x0), Eigen::VectorXd::Constant(1, 0.02)}, root);
  expectJacobiansCorrect(prior, {motionOf(moved(x0, 0.4)), {-0.01}});
}

/// A node and a point of the world.
class PriorOnAPoint : public ::testing::Test {
 protected:
  static PriorTerm prior(const Eigen::MatrixXd& J) {
    return {{std::make_shared<MotionManifold>(), std::make_shared<PointManifold>()},
            {storedMotion(x0()), point0_W()},
            {J, Eigen::VectorXd::Zero(J.rows())}};
  }
  static StateBlock x0() { return SyntheticMotion().state(1.0); }
  static Eigen::VectorXd point0_W() { return Eigen::Vector3d(4.0, 7.0, 1.0); }
  /// Another estimate.
  static StateBlock x() { return moved(x0(), 0.3); }
  static Eigen::Vector3d point_W() { return {4.5, 6.4, 1.3}; }

  /// Derivative of the residual by the tangents of both blocks.
  static Eigen::MatrixXd derivative(const PriorTerm& prior, const StateBlock& x,
                                    const Eigen::Vector3d& point_W) {
    using Stored = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    Stored by_motion(prior.num_residuals(), StateBlock::kMotion), by_point(prior.num_residuals(), 3);
    Eigen::VectorXd r(prior.num_residuals());
    const std::vector<double> motion = motionOf(x);
    const double* const parameters[] = {motion.data(), point_W.data()};
    double* jacobians[] = {by_motion.data(), by_point.data()};
    EXPECT_TRUE(prior.Evaluate(parameters, r.data(), jacobians));
    Eigen::MatrixXd J(prior.num_residuals(), StateBlock::kMotionTangent + 3);
    J << by_motion.leftCols<3>(), by_motion.rightCols<6>(), by_point;
    return J;
  }
};

TEST_F(PriorOnAPoint, JacobiansAreCorrect) {
  Eigen::MatrixXd J(12, 12);
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j) J(i, j) = std::sin(1.0 + 3.1 * i + 1.7 * j);
  const PriorTerm term = prior(J);
  expectJacobiansCorrect(term, {motionOf(x()), {4.5, 6.4, 1.3}});
  EXPECT_LT((derivative(term, x0(), point0_W()) - J).norm(), 1e-9 * J.norm());
}

/// The prior knows only where the node sees the point. A turn of the world with all that is in it, about any
/// axis, and a shift tell it nothing, wherever the estimates have moved since.
TEST_F(PriorOnAPoint, KnowsNothingOfATurnOfTheWorld) {
  const Eigen::Matrix3d R_IW = x0().q_WI().toRotationMatrix().transpose();
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, StateBlock::kMotionTangent + 3);
  J.middleCols<3>(StateBlock::kTheta) = so3::hat(R_IW * (point0_W() - x0().p_W()));
  J.middleCols<3>(StateBlock::kP) = -R_IW;
  J.rightCols<3>() = R_IW;
  const Eigen::MatrixXd now = derivative(prior(J), x(), point_W());
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d turn_W = Eigen::Vector3d::Unit(axis);
    Eigen::VectorXd turned = Eigen::VectorXd::Zero(StateBlock::kMotionTangent + 3);
    turned.segment<3>(StateBlock::kTheta) = x().q_WI().conjugate() * turn_W;
    turned.segment<3>(StateBlock::kP) = turn_W.cross(x().p_W());
    turned.segment<3>(StateBlock::kV) = turn_W.cross(x().v_W());
    turned.tail<3>() = turn_W.cross(point_W());
    EXPECT_LT((now * turned).norm(), 1e-9) << "turn about axis " << axis;
    Eigen::VectorXd shifted = Eigen::VectorXd::Zero(StateBlock::kMotionTangent + 3);
    shifted.segment<3>(StateBlock::kP) = turn_W;
    shifted.tail<3>() = turn_W;
    EXPECT_LT((now * shifted).norm(), 1e-9) << "shift along axis " << axis;
  }
}

}  // namespace
}  // namespace rio_t
