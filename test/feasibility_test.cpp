#include "rio_t/radar/feasibility.h"

#include <gtest/gtest.h>

#include <limits>

namespace rio_t {
namespace {

const Time kStart = Time::fromSeconds(1000.0);

FeasibilityOptions options() {
  FeasibilityOptions o;
  o.window = 0.5;
  o.max_acceleration = 10.0;
  o.margin = 0.2;
  return o;
}

/// One second at 10 Hz with this velocity; the next scan is due at kStart + 1.
FeasibilityCheck afterSteadyMotion(const Eigen::Vector3d& v_R) {
  FeasibilityCheck check(options());
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(check.accept(kStart + 0.1 * i, v_R));
  return check;
}

TEST(Feasibility, TheFirstVelocityPasses) {
  FeasibilityCheck check(options());
  EXPECT_TRUE(check.accept(kStart, {30.0, 0.0, 0.0}));
}

TEST(Feasibility, HardButPossibleManoeuvresPass) {
  FeasibilityCheck check(options());
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(check.accept(kStart + 0.1 * i, {0.9 * i, 0.0, 0.0})) << i;
}

TEST(Feasibility, AJumpIsDiscardedAndLeavesNoTrace) {
  FeasibilityCheck check = afterSteadyMotion({1.0, 0.0, 0.0});
  // The window holds the last 0.5 s, 0.3 s old in the mean: 0.2 + 10 * 0.3 = 3.2 m/s are allowed.
  EXPECT_FALSE(check.accept(kStart + 1.0, {4.3, 0.0, 0.0}));
  EXPECT_FALSE(check.accept(kStart + 1.0, {-2.3, 0.0, 0.0}));
  EXPECT_TRUE(check.accept(kStart + 1.0, {1.0, 0.0, 0.0}));
  EXPECT_TRUE(check.accept(kStart + 1.1, {4.0, 0.0, 0.0}));
}

TEST(Feasibility, ARealJumpIsBelievedWithinTheWindow) {
  FeasibilityCheck check = afterSteadyMotion({1.0, 0.0, 0.0});
  EXPECT_FALSE(check.accept(kStart + 1.0, {20.0, 0.0, 0.0}));
  EXPECT_FALSE(check.accept(kStart + 1.2, {20.0, 0.0, 0.0}));
  // 0.9 + 0.5 is past: nothing is left to disagree with.
  EXPECT_TRUE(check.accept(kStart + 1.45, {20.0, 0.0, 0.0}));
  EXPECT_TRUE(check.accept(kStart + 1.55, {20.0, 0.0, 0.0}));
}

TEST(Feasibility, AGapAllowsMore) {
  FeasibilityCheck check(options());
  EXPECT_TRUE(check.accept(kStart, {0.0, 0.0, 0.0}));
  EXPECT_FALSE(check.accept(kStart + 0.1, {4.0, 0.0, 0.0}));  // 1.2 m/s allowed
  EXPECT_TRUE(check.accept(kStart + 0.4, {4.0, 0.0, 0.0}));   // 4.2 m/s allowed
}

TEST(Feasibility, TimeThatRunsBackStartsAnew) {
  FeasibilityCheck check = afterSteadyMotion({1.0, 0.0, 0.0});
  EXPECT_TRUE(check.accept(kStart, {20.0, 0.0, 0.0}));
}

TEST(Feasibility, NotFiniteIsNotFeasible) {
  FeasibilityCheck check = afterSteadyMotion({1.0, 0.0, 0.0});
  EXPECT_FALSE(check.accept(kStart + 1.0, {std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0}));
  EXPECT_TRUE(check.accept(kStart + 1.0, {1.0, 0.0, 0.0}));
}

}  // namespace
}  // namespace rio_t
