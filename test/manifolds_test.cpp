// Plus and minus of states and mountings, and the derivative of minus.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "factor_setup.h"
#include "rio_t/core/so3.h"
#include "rio_t/factors/motion_manifold.h"
#include "synthetic_motion.h"

namespace rio_t {
namespace {

TEST(StateBlock, BoxminusInvertsBoxplus) {
  const StateBlock x = SyntheticMotion().state(1.0);
  StateTangent delta;
  for (int i = 0; i < StateBlock::kTangent; ++i) delta(i) = 0.3 * std::cos(1.7 * i);
  StateBlock y;
  boxplus(x.data(), delta.data(), y.data());
  EXPECT_LT((boxminus(y.data(), x.data()) - delta).norm(), 1e-12);
}

TEST(StateBlock, BoxplusIsASumToFirstOrder) {
  const StateBlock x = SyntheticMotion().state(1.0);
  for (int i = 0; i < StateBlock::kTangent; ++i) {
    const StateTangent delta = 1e-6 * StateTangent::Unit(i);
    StateBlock y;
    boxplus(x.data(), delta.data(), y.data());
    EXPECT_LT((y.v_W() - x.v_W() - delta.segment<3>(StateBlock::kV)).norm(), 1e-11);
    EXPECT_LT((y.p_W() - x.p_W() - delta.segment<3>(StateBlock::kP)).norm(), 1e-11);
  }
}

// A linear prior must not see a turn of the world about the vertical, because no sensor does.
TEST(StateBlock, ATurnOfTheWorldIsLinearInTheTangentWhateverTheState) {
  const StateBlock x = SyntheticMotion().state(1.0);
  ASSERT_GT(x.v_W().norm(), 0.5);
  const auto turned = [](StateBlock y, double psi) {
    const Eigen::Quaterniond turn = so3::exp(psi * Eigen::Vector3d::UnitZ());
    y.q_WI() = turn * y.q_WI();
    y.v_W() = turn * y.v_W();
    return y;
  };
  const StateTangent direction = 1e3 * boxminus(turned(x, 1e-3).data(), x.data());
  EXPECT_NEAR(direction.norm(), std::hypot(1.0, x.v_W().head<2>().norm()), 1e-9);
  for (const double size : {0.0, 0.3}) {
    const StateBlock y = moved(x, size);
    const StateTangent before = boxminus(y.data(), x.data());
    for (const double psi : {-1.0, 0.1, 2.0}) {
      const StateTangent after = boxminus(turned(y, psi).data(), x.data());
      EXPECT_LT((after - before - psi * direction).norm(), 1e-9) << size << ", " << psi;
    }
  }
}

TEST(MotionManifold, MinusJacobianIsCorrect) {
  const StateBlock x = SyntheticMotion().state(1.0);
  const StateBlock y = moved(SyntheticMotion().state(1.4), 0.3);
  const MotionManifold manifold;
  const int tangent = manifold.tangent();
  Eigen::MatrixXd numeric(tangent, tangent);
  constexpr double h = 1e-6;
  for (int i = 0; i < tangent; ++i) {
    StateBlock ends[2];
    for (const int side : {0, 1}) {
      const Eigen::VectorXd step = (side == 0 ? -h : h) * Eigen::VectorXd::Unit(tangent, i);
      manifold.plus(y.data(), step.data(), ends[side].data());
    }
    numeric.col(i) =
        (manifold.minus(ends[1].data(), x.data()) - manifold.minus(ends[0].data(), x.data())) / (2.0 * h);
  }
  EXPECT_LT((manifold.minusJacobian(y.data(), x.data()) - numeric).cwiseAbs().maxCoeff(), 1e-8);
}

TEST(ExtrinsicsManifold, MinusInvertsPlusAndItsJacobianIsCorrect) {
  for (const EstimateExtrinsics estimate :
       {EstimateExtrinsics::kLeverArm, EstimateExtrinsics::kRotation, EstimateExtrinsics::kPose}) {
    const ExtrinsicsManifold manifold(estimate);
    Eigen::VectorXd delta(manifold.tangent());
    for (int i = 0; i < manifold.tangent(); ++i) delta(i) = 0.4 * std::cos(1.7 * i);
    const std::vector<double> x = storedMounting();
    std::vector<double> y = x;
    manifold.plus(x.data(), delta.data(), y.data());
    EXPECT_LT((manifold.minus(y.data(), x.data()) - delta).norm(), 1e-12);
    // A turn about the axes of I, then a move along them.
    const Extrinsics moved = toExtrinsics(y.data());
    Eigen::Vector3d turn = Eigen::Vector3d::Zero(), move = turn;
    if (estimatesTurn(estimate)) turn = delta.head<3>();
    if (estimatesLeverArm(estimate)) move = delta.tail<3>();
    EXPECT_LT(moved.q_IR.angularDistance(so3::exp(turn) * mounting().q_IR), 1e-12);
    EXPECT_LT((moved.l_I - mounting().l_I - move).norm(), 1e-12);
    Eigen::MatrixXd numeric(manifold.tangent(), manifold.tangent());
    constexpr double h = 1e-6;
    for (int i = 0; i < manifold.tangent(); ++i) {
      std::vector<double> ends[2] = {y, y};
      for (const int side : {0, 1}) {
        const Eigen::VectorXd step = (side == 0 ? -h : h) * Eigen::VectorXd::Unit(manifold.tangent(), i);
        manifold.plus(y.data(), step.data(), ends[side].data());
      }
      numeric.col(i) =
          (manifold.minus(ends[1].data(), x.data()) - manifold.minus(ends[0].data(), x.data())) / (2.0 * h);
    }
    EXPECT_LT((manifold.minusJacobian(y.data(), x.data()) - numeric).cwiseAbs().maxCoeff(), 1e-8);
  }
}

}  // namespace
}  // namespace rio_t
