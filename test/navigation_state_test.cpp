// Compares addHeadingCurvature with headings that are drawn at random.
#include "rio_t/odometry/navigation_state.h"

#include <gtest/gtest.h>

#include <cmath>

#include "noise.h"
#include "rio_t/core/so3.h"

namespace rio_t {
namespace {

using S = StateBlock;

/// A state whose only error is a turn of the heading, 30 m ago, with this sigma [rad].
NavigationState turnedAt30m(double sigma) {
  NavigationState state;
  state.q_WI = so3::exp({0.3, -0.2, 0.7});
  state.p_W = {31.0, 4.0, 2.0};
  state.v_W = {2.0, 0.0, 0.5};
  StateTangent turn = StateTangent::Zero();
  turn.segment<3>(S::kTheta) = state.q_WI.conjugate() * Eigen::Vector3d::UnitZ();
  turn.segment<3>(S::kP) = Eigen::Vector3d::UnitZ().cross(Eigen::Vector3d(30.0, 0.0, 1.0));
  turn.segment<3>(S::kV) = Eigen::Vector3d::UnitZ().cross(state.v_W);
  state.covariance = sigma * sigma * turn * turn.transpose();
  return state;
}

/// Draws headings and returns the mean square of what they take off 30 m [m^2].
double drawn(double sigma) {
  Random random(1);
  double sum = 0.0;
  constexpr int kDraws = 100000;
  for (int i = 0; i < kDraws; ++i) sum += std::pow(30.0 * (1.0 - std::cos(sigma * random.normal())), 2);
  return sum / kDraws;
}

TEST(HeadingCurvature, IsWhatDrawnHeadingsDo) {
  for (const double sigma : {0.1, 0.3, 0.5}) {
    NavigationState state = turnedAt30m(sigma);
    addHeadingCurvature(state);
    EXPECT_NEAR(std::sqrt(state.covariance(S::kP, S::kP) / drawn(sigma)), 1.0, 0.15) << sigma;
    // As the velocity turns with the way, 2 m/s as 30 m.
    EXPECT_NEAR(state.covariance(S::kV, S::kV) / state.covariance(S::kP, S::kP), std::pow(2.0 / 30.0, 2),
                1e-9);
  }
}

TEST(HeadingCurvature, IsNotMoreThanAnyTurn) {
  NavigationState state = turnedAt30m(3.0);
  addHeadingCurvature(state);
  EXPECT_NEAR(state.covariance(S::kP, S::kP), 1.5 * 30.0 * 30.0, 1e-6);  // the mean square of 1 - cos
}

TEST(HeadingCurvature, ChangesNothingElse) {
  for (const double sigma : {0.0, 0.3}) {
    NavigationState state = turnedAt30m(sigma);
    const StateCovariance before = state.covariance;
    addHeadingCurvature(state);
    StateCovariance added = state.covariance - before;
    EXPECT_NEAR(added.leftCols<3>().norm(), 0.0, 1e-12) << "the attitude";
    EXPECT_EQ(added.isZero(0.0), sigma == 0.0);
    for (const int first : {S::kP, S::kV})
      EXPECT_NEAR(added.row(first + 2).norm(), 0.0, 1e-12) << "the vertical";
  }
}

}  // namespace
}  // namespace rio_t
