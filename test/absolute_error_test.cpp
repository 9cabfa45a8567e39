// Association of poses, alignment, and the absolute error.
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <utility>
#include <vector>

#include "evaluation_setup.h"
#include "rio_t/core/so3.h"
#include "rio_t/evaluation/errors.h"
#include "rio_t/evaluation/trajectory.h"

namespace rio_t {
namespace {

// --- Association ---

std::vector<std::pair<std::size_t, std::size_t>> pairs(const std::vector<Match>& matches) {
  std::vector<std::pair<std::size_t, std::size_t>> result;
  result.reserve(matches.size());
  for (const Match& match : matches) result.emplace_back(match.truth, match.estimate);
  return result;
}

Trajectory stamps(const std::vector<double>& seconds) {
  Trajectory trajectory;
  for (const double s : seconds)
    trajectory.push_back({Time::fromSeconds(s), Eigen::Vector3d::Zero(), Eigen::Quaterniond::Identity()});
  return trajectory;
}

using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

TEST(Associate, GivesEachPoseOfTheShorterTheNearestOfTheLonger) {
  const Trajectory few = stamps({1.0, 2.0, 3.0});
  const Trajectory many = stamps({0.5, 0.99, 1.004, 1.5, 1.9, 2.2, 3.009});
  EXPECT_EQ(pairs(associate(few, many)), (Pairs{{0, 2}, {2, 6}}));
  EXPECT_EQ(pairs(associate(many, few)), (Pairs{{2, 0}, {6, 2}}));
  EXPECT_EQ(pairs(associate(few, many, 0.005)), (Pairs{{0, 2}}));
  EXPECT_EQ(pairs(associate(few, many, 0.15)), (Pairs{{0, 2}, {1, 4}, {2, 6}}));
}

TEST(Associate, TakesTheEarlierOfTwoEquallyNear) {
  EXPECT_EQ(pairs(associate(stamps({1.0}), stamps({0.5, 1.5}), 1.0)), (Pairs{{0, 0}}));
}

TEST(Associate, CountsTheEstimateAsShorterWhereLengthsAreEqual) {
  // From the estimate's side both of its poses match the truth's first; the other way it would be
  // {0,0},{1,1}.
  EXPECT_EQ(pairs(associate(stamps({1.0, 9.0}), stamps({0.9, 1.2}), 10.0)), (Pairs{{0, 0}, {0, 1}}));
}

TEST(Associate, HandlesTheEdges) {
  EXPECT_TRUE(associate({}, helix()).empty());
  EXPECT_TRUE(associate(helix(), {}).empty());
  EXPECT_TRUE(associate({}, {}).empty());
  EXPECT_EQ(pairs(associate(stamps({5.0}), stamps({1.0, 2.0}), 3.0)), (Pairs{{0, 1}}));
  EXPECT_EQ(pairs(associate(stamps({0.0}), stamps({1.0, 2.0}), 1.0)), (Pairs{{0, 0}}));
  EXPECT_TRUE(associate(stamps({0.0}), stamps({1.0, 2.0}), 0.999).empty());
}

TEST(Associate, TruthAtTwentyHertzMatchesAnEstimateAtImuRateByDefault) {
  Trajectory truth;
  for (int i = 0; i < 200; ++i) truth.push_back(pose(0.05 * i, {0, 0, 0}));
  Trajectory estimate;
  for (int i = 0; i < 2050; ++i) estimate.push_back(pose(0.0003 + i / 205.0, {0, 0, 0}));
  const std::vector<Match> matches = associate(truth, estimate);
  ASSERT_EQ(matches.size(), truth.size());
  for (const Match& match : matches) {
    EXPECT_LE(std::abs(truth[match.truth].time - estimate[match.estimate].time), 0.5 / 205.0 + 1e-9);
  }
}

// --- Absolute error ---

TEST(AbsoluteError, OfTheTruthItselfIsZero) {
  for (const Alignment kind : {Alignment::kNone, Alignment::kOrigin, Alignment::kYaw, Alignment::kSe3}) {
    const AbsoluteError error = absoluteError(helix(), helix(), kind);
    EXPECT_EQ(error.matched_poses, 101u);
    EXPECT_NEAR(error.translation_m.max, 0.0, kExact);
    EXPECT_NEAR(error.rotation_deg.max, 0.0, 1e-6);
  }
}

TEST(AbsoluteError, AConstantShiftShowsUntilItIsAligned) {
  const Trajectory estimate = moved(helix(), so3::exp({0, 0, 0}), {3, 4, 12});
  const AbsoluteError none = absoluteError(helix(), estimate, Alignment::kNone);
  EXPECT_NEAR(none.translation_m.rmse, 13.0, kExact);
  EXPECT_NEAR(none.translation_m.mean, 13.0, kExact);
  EXPECT_NEAR(none.translation_m.median, 13.0, kExact);
  EXPECT_NEAR(none.translation_m.max, 13.0, kExact);
  EXPECT_NEAR(none.rotation_deg.max, 0.0, 1e-6);
  for (const Alignment kind : {Alignment::kOrigin, Alignment::kYaw, Alignment::kSe3}) {
    EXPECT_NEAR(absoluteError(helix(), estimate, kind).translation_m.max, 0.0, kExact);
  }
}

TEST(AbsoluteError, AnyRigidMotionIsAlignedByOriginAndSe3) {
  const Trajectory estimate = moved(helix(), so3::exp({0.4, -1.1, 2.0}), {7, -8, 9});
  EXPECT_GT(absoluteError(helix(), estimate, Alignment::kNone).translation_m.rmse, 1.0);
  for (const Alignment kind : {Alignment::kOrigin, Alignment::kSe3}) {
    const AbsoluteError error = absoluteError(helix(), estimate, kind);
    EXPECT_NEAR(error.translation_m.max, 0.0, kExact);
    EXPECT_NEAR(error.rotation_deg.max, 0.0, 1e-5);
  }
}

TEST(AbsoluteError, YawAlignmentTurnsAboutTheVerticalOnly) {
  const Trajectory turned = moved(helix(), so3::exp({0, 0, -2.9}), {1, 2, 3});
  EXPECT_NEAR(absoluteError(helix(), turned, Alignment::kYaw).translation_m.max, 0.0, kExact);
  EXPECT_NEAR(absoluteError(helix(), turned, Alignment::kYaw).rotation_deg.max, 0.0, 1e-5);

  const Trajectory tilted = moved(helix(), so3::exp({0.1, 0, 0}), {0, 0, 0});
  EXPECT_GT(absoluteError(helix(), tilted, Alignment::kYaw).translation_m.rmse, 0.05);
  EXPECT_NEAR(absoluteError(helix(), tilted, Alignment::kYaw).rotation_deg.mean, 0.1 * 180.0 / M_PI, 0.2);
  EXPECT_NEAR(absoluteError(helix(), tilted, Alignment::kSe3).translation_m.max, 0.0, kExact);
}

TEST(AbsoluteError, StatisticsOfKnownErrors) {
  // Errors 0, 1, 2, 5 m and 0, 10, 20, 50 deg; the first pose is exact, so the origin changes nothing.
  const Trajectory truth = {pose(0, {0, 0, 0}), pose(1, {1, 0, 0}), pose(2, {2, 0, 0}), pose(3, {3, 0, 0})};
  const Trajectory estimate = {pose(0, {0, 0, 0}), pose(1, {1, 1, 0}, 10), pose(2, {2, 0, 2}, -20),
                               pose(3, {6, 4, 0}, 50)};
  for (const Alignment kind : {Alignment::kNone, Alignment::kOrigin}) {
    const AbsoluteError error = absoluteError(truth, estimate, kind);
    EXPECT_NEAR(error.translation_m.rmse, std::sqrt(30.0 / 4.0), kExact);
    EXPECT_NEAR(error.translation_m.mean, 2.0, kExact);
    EXPECT_NEAR(error.translation_m.median, 1.5, kExact);
    EXPECT_NEAR(error.translation_m.max, 5.0, kExact);
    EXPECT_NEAR(error.rotation_deg.rmse, std::sqrt(3000.0 / 4.0), kExact);
    EXPECT_NEAR(error.rotation_deg.mean, 20.0, kExact);
    EXPECT_NEAR(error.rotation_deg.median, 15.0, kExact);
    EXPECT_NEAR(error.rotation_deg.max, 50.0, kExact);
  }
}

TEST(AbsoluteError, OriginAlignmentSwingsAWrongFirstHeadingRound) {
  Trajectory estimate = helix();
  estimate[0].q_WI = estimate[0].q_WI * so3::exp({0, 0, 90.0 * M_PI / 180.0});
  const AbsoluteError error = absoluteError(helix(), estimate, Alignment::kOrigin);
  // A point r away from the start is moved by 2 r sin(45 deg) horizontally.
  const double r = helix().back().p_W.head<2>().norm();
  EXPECT_NEAR(error.translation_m.max, std::sqrt(2.0) * r, 1e-6);
  EXPECT_NEAR(error.rotation_deg.median, 90.0, 1e-6);
}

TEST(AbsoluteError, LeastSquaresIsBetterThanTheOrigin) {
  const Trajectory truth = readTum(testData("evaluation_truth.txt"));
  const Trajectory estimate = readTum(testData("evaluation_estimate.txt"));
  const double origin = absoluteError(truth, estimate, Alignment::kOrigin).translation_m.rmse;
  const double yaw = absoluteError(truth, estimate, Alignment::kYaw).translation_m.rmse;
  const double se3 = absoluteError(truth, estimate, Alignment::kSe3).translation_m.rmse;
  EXPECT_LT(yaw, origin);
  EXPECT_LT(se3, yaw);
}

TEST(AbsoluteError, Se3AlignmentIsARotationForAMirrorImage) {
  Trajectory mirrored = helix();
  for (StampedPose& p : mirrored) p.p_W.y() = -p.p_W.y();
  const std::vector<Match> matches = associate(helix(), mirrored);
  const RigidTransform T_TE = alignment(helix(), mirrored, matches, Alignment::kSe3);
  EXPECT_NEAR(T_TE.q_TE.toRotationMatrix().determinant(), 1.0, kExact);
  EXPECT_NEAR(T_TE.q_TE.norm(), 1.0, kExact);
}

TEST(AbsoluteError, RefusesWhatCannotBeCompared) {
  const Trajectory line = {pose(0, {0, 0, 0}), pose(1, {1, 1, 0}), pose(2, {2, 2, 0})};
  EXPECT_THROW(absoluteError(line, line, Alignment::kSe3), std::invalid_argument);
  EXPECT_NO_THROW(absoluteError(line, line, Alignment::kYaw));
  const Trajectory standing = {pose(0, {1, 1, 0}), pose(1, {1, 1, 0}), pose(2, {1, 1, 0})};
  EXPECT_THROW(absoluteError(standing, standing, Alignment::kSe3), std::invalid_argument);
  EXPECT_THROW(absoluteError(standing, standing, Alignment::kYaw), std::invalid_argument);
  EXPECT_NO_THROW(absoluteError(standing, standing, Alignment::kOrigin));
  EXPECT_THROW(absoluteError(helix(), {}, Alignment::kNone), std::invalid_argument);
  EXPECT_THROW(absoluteError({}, helix(), Alignment::kOrigin), std::invalid_argument);
  EXPECT_THROW(absoluteError(helix(), {pose(99, {0, 0, 0})}, Alignment::kOrigin), std::invalid_argument);
}

TEST(PoseErrors, TellWhereTheErrorIs) {
  const Trajectory truth = {pose(0, {0, 0, 0}), pose(1, {1, 0, 0}, 170), pose(2, {2, 0, 0})};
  const Trajectory estimate = {pose(0.001, {0, 0, 0}), pose(1.001, {1, 0.5, 0}, -170),
                               pose(2.001, {2, 0, 0})};
  const std::vector<PoseError> errors =
      poseErrors(truth, moved(estimate, so3::exp({0.2, 0.3, 1.0}), {7, 8, 9}), Alignment::kOrigin);
  ASSERT_EQ(errors.size(), 3u);
  EXPECT_EQ(errors[1].time, at(1.001));
  EXPECT_LT((errors[1].p_T - Eigen::Vector3d(1, 0.5, 0)).norm(), kExact);
  EXPECT_EQ(errors[1].truth_T, Eigen::Vector3d(1, 0, 0));
  EXPECT_NEAR(errors[1].angle_deg, 20.0, 1e-6);
  EXPECT_NEAR(errors[1].yaw_deg, 20.0, 1e-6);
  EXPECT_NEAR(errors[2].yaw_deg, 0.0, 1e-6);
}

}  // namespace
}  // namespace rio_t
