// What a new start or a blind IMU leaves unknown of position and heading, in what is published.
#include "rio_t/odometry/pose_inflation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "rio_t/core/so3.h"
#include "rio_t/factors/state_block.h"

namespace rio_t {
namespace {

constexpr double kHeading = 0.1;  // [rad]

/// Known without error, tilted, at `p_W`.
NavigationState stateAt(const Eigen::Vector3d& p_W) {
  NavigationState state;
  state.p_W = p_W;
  state.v_W = {2.0, 0.0, 0.0};
  state.q_WI = so3::exp({0.3, -0.2, 0.7});
  return state;
}

double headingVariance(const NavigationState& state) {
  const Eigen::Vector3d up_I = state.q_WI.conjugate() * Eigen::Vector3d::UnitZ();
  return up_I.dot(state.covariance.topLeftCorner<3, 3>() * up_I);
}

Eigen::Matrix3d block(const NavigationState& state, int first) {
  return state.covariance.block<3, 3>(first, first);
}

TEST(PoseInflation, KeepsWhatWasPublishedAndSpreadsFromThere) {
  NavigationState published = stateAt({5.0, 1.0, 0.0});
  published.covariance.block<3, 3>(StateBlock::kP, StateBlock::kP).diagonal() << 0.04, 0.09, 0.01;
  const Eigen::Vector3d up_I = published.q_WI.conjugate() * Eigen::Vector3d::UnitZ();
  published.covariance.topLeftCorner<3, 3>() = kHeading * kHeading * up_I * up_I.transpose();
  const PoseInflation doubt(published);

  NavigationState there = stateAt(published.p_W);
  doubt.addTo(there);
  EXPECT_LT((block(there, StateBlock::kP) - block(published, StateBlock::kP)).norm(), 1e-12);
  EXPECT_NEAR(headingVariance(there), kHeading * kHeading, 1e-12);
  EXPECT_NEAR(block(there, StateBlock::kV)(1, 1), std::pow(2.0 * kHeading, 2), 1e-12)
      << "the velocity turns with it";

  // 30 m ahead along x: sideways 3 m more, and nothing along the way.
  NavigationState ahead = stateAt(published.p_W + Eigen::Vector3d(30.0, 0.0, 0.0));
  doubt.addTo(ahead);
  EXPECT_NEAR(block(ahead, StateBlock::kP)(0, 0), 0.04, 1e-12);
  EXPECT_NEAR(block(ahead, StateBlock::kP)(1, 1), 0.09 + std::pow(30.0 * kHeading, 2), 1e-9);
}

TEST(PoseInflation, NoneAddsNothing) {
  NavigationState state = stateAt({5.0, 1.0, 0.0});
  PoseInflation().addTo(state);
  YawInflation().addTo(state);
  EXPECT_EQ(state.covariance, StateCovariance::Zero());
}

TEST(YawInflation, AddsWhatTheWindowForgot) {
  YawInflation doubt;
  doubt.add(kHeading * kHeading, {5.0, 1.0, 0.0});
  NavigationState ahead = stateAt({35.0, 1.0, 0.0});
  doubt.addTo(ahead);
  EXPECT_NEAR(headingVariance(ahead), kHeading * kHeading, 1e-12);
  EXPECT_NEAR(block(ahead, StateBlock::kP)(1, 1), std::pow(30.0 * kHeading, 2), 1e-9);
  // cos(psi) shortens the way by psi^2 / 2, whose mean square is 3 s^4 / 4.
  EXPECT_NEAR(block(ahead, StateBlock::kP)(0, 0), 0.75 * std::pow(kHeading, 4) * 30.0 * 30.0, 1e-9);
}

TEST(YawInflation, AddsNoTurnWhereTheWindowStillKnowsOfIt) {
  YawInflation doubt;
  doubt.add(kHeading * kHeading, {5.0, 1.0, 0.0});
  NavigationState state = stateAt({35.0, 1.0, 0.0});
  const Eigen::Vector3d up_I = state.q_WI.conjugate() * Eigen::Vector3d::UnitZ();
  state.covariance.topLeftCorner<3, 3>() = 4.0 * kHeading * kHeading * up_I * up_I.transpose();
  doubt.addTo(state);
  EXPECT_NEAR(headingVariance(state), 4.0 * kHeading * kHeading, 1e-12);
  EXPECT_NEAR(block(state, StateBlock::kP)(1, 1), 0.0, 1e-12);
}

}  // namespace
}  // namespace rio_t
