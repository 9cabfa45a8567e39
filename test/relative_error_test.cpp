// The relative error per metre and per second, and the drift.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "evaluation_setup.h"
#include "rio_t/core/so3.h"
#include "rio_t/evaluation/errors.h"
#include "rio_t/evaluation/trajectory.h"

namespace rio_t {
namespace {

/// 1 m/s along x, at 8 Hz; binary fractions of a metre, so that sums are exact.
Trajectory straight(int poses, double scale = 1.0, double yaw_deg_per_s = 0.0) {
  Trajectory trajectory;
  for (int i = 0; i < poses; ++i) {
    trajectory.push_back(pose(0.125 * i, {0.125 * i * scale, 0, 0}, yaw_deg_per_s * 0.125 * i));
  }
  return trajectory;
}

TEST(RelativeError, DoesNotSeeWhereTheEstimateStarts) {
  const RelativeError error = relativeError(helix(), moved(helix(), so3::exp({0.3, -0.8, 1.7}), {4, 5, 6}));
  EXPECT_GT(error.pairs, 5u);
  EXPECT_NEAR(error.translation_m.max, 0.0, kExact);
  EXPECT_NEAR(error.rotation_deg.max, 0.0, 1e-5);
}

TEST(RelativeError, PiecesFollowEachOtherFromTheFirstFullMetre) {
  // 81 poses, 10 m: ends at 1, 2, ... 10 m, so nine pieces between them.
  EXPECT_EQ(relativeError(straight(81), straight(81)).pairs, 9u);
  EXPECT_EQ(relativeError(straight(80), straight(80)).pairs, 8u);
  EXPECT_EQ(relativeError(straight(9), straight(9)).pairs, 0u);
  RelativeErrorOptions two_metres;
  two_metres.delta = 2.0;
  EXPECT_EQ(relativeError(straight(81), straight(81), two_metres).pairs, 4u);
}

TEST(RelativeError, AllPairsStartAtEveryPoseThatHasAMetreAhead) {
  RelativeErrorOptions all;
  all.all_pairs = true;
  // Steps of 1/8 m: a pose with less than a full metre ahead is at least an eighth off, more than a tenth.
  EXPECT_EQ(relativeError(straight(81), straight(81), all).pairs, 73u);
  EXPECT_EQ(relativeError(straight(9), straight(9), all).pairs, 1u);
  EXPECT_EQ(relativeError(straight(8), straight(8), all).pairs, 0u);
}

TEST(RelativeError, ScaleErrorShowsPerMetre) {
  const RelativeError error = relativeError(straight(81), straight(81, 1.25));
  // The estimate's steps are 1.25/8 m: the seventh completes its metre, with 1.09375 m against 0.875 m of
  // truth.
  EXPECT_NEAR(error.translation_m.rmse, 0.21875, kExact);
  EXPECT_NEAR(error.translation_m.max, 0.21875, kExact);
  EXPECT_NEAR(error.rotation_deg.max, 0.0, 1e-6);
}

TEST(RelativeError, TurnRateErrorShowsPerSecond) {
  RelativeErrorOptions second;
  second.unit = DeltaUnit::kSeconds;
  const RelativeError error = relativeError(straight(81), straight(81, 1.0, 3.0), second);
  EXPECT_EQ(error.pairs, 9u);
  EXPECT_NEAR(error.rotation_deg.rmse, 3.0, 1e-6);
  EXPECT_NEAR(error.rotation_deg.mean, 3.0, 1e-6);
}

TEST(RelativeError, SecondsAreCountedInWholePeriodsWhateverTheirRounding) {
  Trajectory standing;  // 100 s at 25 Hz: 0.04 is no binary fraction
  for (int i = 0; i <= 2500; ++i) standing.push_back(pose(0.04 * i, {0, 0, 0}));
  RelativeErrorOptions second;
  second.unit = DeltaUnit::kSeconds;
  EXPECT_EQ(relativeError(standing, standing, second).pairs, 99u);
  second.all_pairs = true;
  // 2476 poses have a full second ahead, two more have 0.96 s and 0.92 s, which is within a tenth.
  EXPECT_EQ(relativeError(standing, standing, second).pairs, 2478u);
  EXPECT_EQ(relativeError(standing, standing).pairs, 0u);
}

TEST(RelativeError, RefusesWrongPieces) {
  RelativeErrorOptions options;
  options.delta = 0.0;
  EXPECT_THROW(relativeError(helix(), helix(), options), std::invalid_argument);
  options.delta = std::nan("");
  EXPECT_THROW(relativeError(helix(), helix(), options), std::invalid_argument);
  EXPECT_THROW(relativeError(helix(), {}), std::invalid_argument);
}

TEST(Drift, IsTheLastErrorPerMetre) {
  Trajectory estimate = straight(81);
  estimate.back().p_W += Eigen::Vector3d(0.3, 0.4, 1.2);
  estimate.back().q_WI = so3::exp({0, 0, -4.0 * M_PI / 180.0});
  estimate = moved(estimate, so3::exp({0, 0, 1.0}), {5, 5, 5});
  const Drift result = drift(straight(81), estimate);
  EXPECT_NEAR(result.path_m, 10.0, kExact);
  EXPECT_NEAR(result.final_m, 1.3, kExact);
  EXPECT_NEAR(result.final_horizontal_m, 0.5, kExact);
  EXPECT_NEAR(result.final_yaw_deg, -4.0, 1e-6);
  EXPECT_NEAR(result.per_metre, 0.13, kExact);
}

TEST(Drift, YawErrorWrapsRound) {
  const Trajectory truth = {pose(0, {0, 0, 0}, 0), pose(1, {1, 0, 0}, 179)};
  const Trajectory estimate = {pose(0, {0, 0, 0}, 0), pose(1, {1, 0, 0}, -179)};
  EXPECT_NEAR(drift(truth, estimate).final_yaw_deg, 2.0, 1e-6);
}

TEST(Drift, AtRestIsNotPerMetre) {
  const Trajectory truth = {pose(0, {0, 0, 0}), pose(1, {0, 0, 0})};
  const Trajectory estimate = {pose(0, {0, 0, 0}), pose(1, {1, 0, 0})};
  EXPECT_EQ(drift(truth, estimate).per_metre, 0.0);
  EXPECT_NEAR(drift(truth, estimate).final_m, 1.0, kExact);
}

}  // namespace
}  // namespace rio_t
