#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

#include "rio_t/core/so3.h"
#include "rio_t/evaluation/errors.h"
#include "rio_t/evaluation/offset_error.h"
#include "rio_t/evaluation/trajectory.h"

namespace rio_t {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kExact = 1e-9;

Time at(double seconds) { return Time::fromNanoseconds(1700000000000000000) + seconds; }

StampedPose pose(double seconds, const Eigen::Vector3d& p_W, double yaw_deg = 0.0) {
  return {at(seconds), p_W, so3::exp({0.0, 0.0, yaw_deg * kPi / 180.0})};
}

/// 1 m/s along a circle of 5 m radius that climbs a little, heading along the path, 10 Hz.
Trajectory helix(int poses = 101) {
  Trajectory trajectory;
  for (int i = 0; i < poses; ++i) {
    const double t = 0.1 * i;
    const double angle = t / 5.0;
    trajectory.push_back(
        pose(t, {5.0 * std::sin(angle), 5.0 * (1.0 - std::cos(angle)), 0.05 * t}, angle * 180.0 / kPi));
  }
  return trajectory;
}

Trajectory moved(const Trajectory& trajectory, const Eigen::Quaterniond& q, const Eigen::Vector3d& t) {
  return transformed(RigidTransform{q, t}, trajectory);
}

Trajectory read(const std::string& text) {
  std::istringstream in(text);
  return readTum(in, "made_up.txt");
}

/// The message with which reading fails; empty if it does not.
std::string readFailure(const std::string& text) {
  try {
    read(text);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

std::string testData(const std::string& name) { return std::string(RIO_T_SOURCE_DIR) + "/test/data/" + name; }

// --- Time from text ---

TEST(ParseTime, KeepsEveryNanosecond) {
  EXPECT_EQ(parseTime("1700000010.012222").nanoseconds(), 1700000010012222000);
  EXPECT_EQ(parseTime("1700000010.123456789").nanoseconds(), 1700000010123456789);
  EXPECT_EQ(parseTime("1700000010.000000001").nanoseconds(), 1700000010000000001);
  EXPECT_EQ(parseTime("1700000010").nanoseconds(), 1700000010000000000);
  EXPECT_EQ(parseTime("+0.5").nanoseconds(), 500000000);
  EXPECT_EQ(parseTime(".25").nanoseconds(), 250000000);
  EXPECT_EQ(parseTime("-1.5").nanoseconds(), -1500000000);
}

TEST(ParseTime, IsTheInverseOfFormatTime) {
  EXPECT_EQ(formatTime(Time::fromNanoseconds(1700000010000000001)), "1700000010.000000001");
  for (const std::int64_t ns : {std::int64_t{0}, std::int64_t{-1}, std::int64_t{-1500000000},
                                std::int64_t{9200000000123456789}, std::int64_t{-9200000000123456789}}) {
    EXPECT_EQ(parseTime(formatTime(Time::fromNanoseconds(ns))).nanoseconds(), ns);
  }
}

TEST(ParseTime, RoundsBeyondNanoseconds) {
  EXPECT_EQ(parseTime("1.0000000004").nanoseconds(), 1000000000);
  EXPECT_EQ(parseTime("1.0000000005").nanoseconds(), 1000000001);
  EXPECT_EQ(parseTime("1.9999999999").nanoseconds(), 2000000000);
}

TEST(ParseTime, ReadsExponentsAsNumpyWritesThem) {
  EXPECT_EQ(parseTime("1.700000010012222e+09").nanoseconds(), 1700000010012222000);
  EXPECT_EQ(parseTime("1.700000010012222051620483398e+09").nanoseconds(), 1700000010012222052);
  EXPECT_EQ(parseTime("25E-2").nanoseconds(), 250000000);
  EXPECT_EQ(parseTime("1e-20").nanoseconds(), 0);
}

TEST(ParseTime, RefusesWhatIsNoTime) {
  for (const char* text : {"", "-", ".", "abc", "1.5s", "1e", "1e5x", "1.2.3", "nan", "inf", "0x10", " 1",
                           "1700000010012222000", "1e300"}) {
    EXPECT_THROW(parseTime(text), std::invalid_argument) << "'" << text << "'";
  }
}

// --- Files ---

TEST(Tum, ReadsPosesCommentsAndBlankLines) {
  const Trajectory trajectory = read(
      "# stamp x y z qx qy qz qw\n\n1700000000.000000001 1 2 3 0 0 0.6 0.8 \r\n   \n  # more\n"
      "1.7000000005e+09\t-1.5 0 2e-1 1 0 0 0");
  ASSERT_EQ(trajectory.size(), 2u);
  EXPECT_EQ(trajectory[0].time.nanoseconds(), 1700000000000000001);
  EXPECT_TRUE(trajectory[0].p_W.isApprox(Eigen::Vector3d(1, 2, 3)));
  EXPECT_TRUE(trajectory[0].q_WI.isApprox(Eigen::Quaterniond(0.8, 0, 0, 0.6)));
  EXPECT_EQ(trajectory[1].time.nanoseconds(), 1700000000500000000);
  EXPECT_TRUE(trajectory[1].p_W.isApprox(Eigen::Vector3d(-1.5, 0, 0.2)));
  EXPECT_TRUE(trajectory[1].q_WI.isApprox(Eigen::Quaterniond(0, 1, 0, 0)));
}

TEST(Tum, NormalisesRoundedQuaternions) {
  EXPECT_NEAR(read("1 0 0 0 0 0 0.71 0.70\n")[0].q_WI.norm(), 1.0, 1e-15);
}

TEST(Tum, NamesFileLineAndExpectation) {
  const std::string good = "# header\n1.0 0 0 0 0 0 0 1\n";
  const auto expectFailure = [&good](const std::string& line, const std::string& reason) {
    const std::string message = readFailure(good + line + "\n");
    EXPECT_TRUE(contains(message, "made_up.txt:3: ")) << message;
    EXPECT_TRUE(contains(message, reason)) << message;
    EXPECT_TRUE(contains(message, "expected")) << message;
  };
  expectFailure("2.0 0 0 0 0 0 1", "found 7 fields");
  expectFailure("2.0 0 0 0 0 0 0 1 5", "found 9 fields");
  expectFailure("2.0,0,0,0,0,0,0,1", "found 1 fields");
  expectFailure("2.0 0 zero 0 0 0 0 1", "'zero' is not a finite number");
  expectFailure("2.0 0 nan 0 0 0 0 1", "'nan' is not a finite number");
  expectFailure("2.0 0 0 0 0 0 0 inf", "'inf' is not a finite number");
  expectFailure("1700000010012222000 0 0 0 0 0 0 1", "is not a time in seconds");
  expectFailure("2.0 0 0 0 0 0 0 0", "norm 0.0");
  expectFailure("2.0 0 0 0 0 0 0 1.1", "norm 1.1");
  expectFailure("1.0 0 0 0 0 0 0 1", "increasing stamps");
  expectFailure("0.999999999 0 0 0 0 0 0 1", "increasing stamps");
}

TEST(Tum, MissingFileIsNamed) {
  try {
    readTum("no/such/file.txt");
    FAIL() << "no exception";
  } catch (const std::runtime_error& error) {
    EXPECT_TRUE(contains(error.what(), "no/such/file.txt")) << error.what();
  }
  EXPECT_THROW(writeTum("no/such/folder/file.txt", helix()), std::runtime_error);
}

TEST(Tum, WritesWhatItReads) {
  Trajectory written = helix();
  written[0].time = Time::fromNanoseconds(-1500000000);
  written[1].time = Time::fromNanoseconds(-1);
  written[2].time = Time::fromNanoseconds(1234567890123456789);
  written.resize(3);
  std::ostringstream text;
  for (const StampedPose& p : written) writeTumLine(text, p);
  const Trajectory back = read(text.str());
  ASSERT_EQ(back.size(), written.size());
  for (std::size_t i = 0; i < back.size(); ++i) {
    EXPECT_EQ(back[i].time, written[i].time) << i;
    EXPECT_LT((back[i].p_W - written[i].p_W).norm(), 1e-9) << i;
    EXPECT_LT(back[i].q_WI.angularDistance(written[i].q_WI), 1e-8) << i;
  }
}

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
  EXPECT_NEAR(absoluteError(helix(), tilted, Alignment::kYaw).rotation_deg.mean, 0.1 * 180.0 / kPi, 0.2);
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
  estimate[0].q_WI = estimate[0].q_WI * so3::exp({0, 0, 90.0 * kPi / 180.0});
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

// --- Relative error ---

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
  estimate.back().q_WI = so3::exp({0, 0, -4.0 * kPi / 180.0});
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

// --- Known figures ---

struct Figures {
  double rmse, mean, max;
};

void expectFigures(const Statistics& s, const Figures& expected) {
  const double last_digit = 0.51e-6;  // the figures have six decimals
  EXPECT_NEAR(s.rmse, expected.rmse, last_digit);
  EXPECT_NEAR(s.mean, expected.mean, last_digit);
  EXPECT_NEAR(s.max, expected.max, last_digit);
}

// Figures from a plain transcription of evo's definitions in numpy (a full search for each pose, 4x4
// matrices), which also gives evo's own figures of the next test.
TEST(Figures, OfCommittedFiles) {
  const Trajectory truth = readTum(testData("evaluation_truth.txt"));
  const Trajectory estimate = readTum(testData("evaluation_estimate.txt"));
  ASSERT_EQ(truth.size(), 241u);
  ASSERT_EQ(estimate.size(), 584u);

  const AbsoluteError origin = absoluteError(truth, estimate, Alignment::kOrigin);
  EXPECT_EQ(origin.matched_poses, 225u);
  expectFigures(origin.translation_m, {0.025482, 0.023364, 0.045156});
  expectFigures(origin.rotation_deg, {1.077698, 1.005587, 1.730499});
  EXPECT_NEAR(origin.translation_m.median, 0.023298, 0.51e-6);
  EXPECT_NEAR(origin.rotation_deg.median, 1.126887, 0.51e-6);

  const AbsoluteError se3 = absoluteError(truth, estimate, Alignment::kSe3);
  expectFigures(se3.translation_m, {0.014667, 0.013245, 0.037848});
  expectFigures(se3.rotation_deg, {1.254032, 1.159801, 1.962038});

  const AbsoluteError yaw = absoluteError(truth, estimate, Alignment::kYaw);
  expectFigures(yaw.translation_m, {0.015262, 0.013604, 0.038771});
  expectFigures(yaw.rotation_deg, {1.249925, 1.168783, 1.973520});

  const RelativeError metre = relativeError(truth, estimate);
  EXPECT_EQ(metre.pairs, 10u);
  expectFigures(metre.translation_m, {0.028438, 0.026558, 0.041871});
  expectFigures(metre.rotation_deg, {0.814888, 0.757051, 1.428162});

  RelativeErrorOptions options;
  options.all_pairs = true;
  const RelativeError all = relativeError(truth, estimate, options);
  EXPECT_EQ(all.pairs, 209u);
  expectFigures(all.translation_m, {0.025786, 0.024129, 0.048635});
  expectFigures(all.rotation_deg, {0.796188, 0.746614, 1.468487});

  // A tighter limit leaves out truth that falls between the estimate's poses, here most of it.
  EXPECT_EQ(absoluteError(truth, estimate, Alignment::kOrigin, 0.003).matched_poses, 72u);
  EXPECT_NEAR(absoluteError(truth, estimate, Alignment::kOrigin, 0.003).translation_m.rmse, 0.024587,
              0.51e-6);
}

struct EvoFigures {
  std::string name, truth, estimate;
  std::size_t matched;
  Figures origin_m, origin_deg, se3_m, se3_deg;
  double metre_m, metre_deg;
  std::size_t pairs;
  double all_m, all_deg;
  std::size_t all_pairs;
};

/// Figures that evo itself computed on files too large to commit.
const EvoFigures kEvo[] = {
    {"ekf_rio_mocap_easy_m9",
     "/sim/mocap_easy_m9.gt.txt",
     "/eval/ekf_rio_mocap_easy_m9.txt",
     8115,
     {0.058367, 0.055260, 0.084367},
     {0.363612, 0.342779, 0.724655},
     {0.040816, 0.038705, 0.069779},
     {0.329626, 0.319907, 0.550763},
     0.013503,
     0.128804,
     53,
     0.013889,
     0.119935,
     5405},
    {"authors_mocap_medium_p30",
     "/sim/mocap_medium_p30.gt.txt",
     "/eval/authors_mocap_medium_p30.txt",
     8367,
     {0.298575, 0.258098, 0.483595},
     {0.729313, 0.684299, 2.606080},
     {0.172319, 0.156688, 0.326971},
     {1.319287, 1.293084, 2.756566},
     0.054291,
     0.547607,
     65,
     0.044769,
     0.559674,
     7078},
};

class EvoComparison : public testing::TestWithParam<EvoFigures> {};

TEST_P(EvoComparison, GivesTheSameFigures) {
  const EvoFigures& evo = GetParam();
  const char* folder = std::getenv("RIO_T_DATA_DIR");  // NOLINT(concurrency-mt-unsafe): nobody sets it
  const std::string data = folder != nullptr ? folder : std::string(RIO_T_SOURCE_DIR) + "/../shared/data";
  for (const std::string& file : {data + evo.truth, data + evo.estimate}) {
    if (!std::ifstream(file)) GTEST_SKIP() << file << " is absent (folder: RIO_T_DATA_DIR)";
  }
  const Trajectory truth = readTum(data + evo.truth);
  const Trajectory estimate = readTum(data + evo.estimate);
  const double max_difference = 0.002;

  const AbsoluteError origin = absoluteError(truth, estimate, Alignment::kOrigin, max_difference);
  EXPECT_EQ(origin.matched_poses, evo.matched);
  expectFigures(origin.translation_m, evo.origin_m);
  expectFigures(origin.rotation_deg, evo.origin_deg);
  const AbsoluteError se3 = absoluteError(truth, estimate, Alignment::kSe3, max_difference);
  expectFigures(se3.translation_m, evo.se3_m);
  expectFigures(se3.rotation_deg, evo.se3_deg);

  RelativeErrorOptions options;
  const RelativeError metre = relativeError(truth, estimate, options, max_difference);
  EXPECT_EQ(metre.pairs, evo.pairs);
  EXPECT_NEAR(metre.translation_m.rmse, evo.metre_m, 0.51e-6);
  EXPECT_NEAR(metre.rotation_deg.rmse, evo.metre_deg, 0.51e-6);
  options.all_pairs = true;
  const RelativeError all = relativeError(truth, estimate, options, max_difference);
  EXPECT_EQ(all.pairs, evo.all_pairs);
  EXPECT_NEAR(all.translation_m.rmse, evo.all_m, 0.51e-6);
  EXPECT_NEAR(all.rotation_deg.rmse, evo.all_deg, 0.51e-6);
}

INSTANTIATE_TEST_SUITE_P(Figures, EvoComparison, testing::ValuesIn(kEvo),
                         [](const testing::TestParamInfo<EvoFigures>& evo) { return evo.param.name; });

// --- Time offset ---

std::vector<OffsetSample> readOffsets(const std::string& text) {
  std::istringstream in(text);
  return readTimeOffsets(in, "offset.csv");
}

TEST(Offset, ReadsItsColumnsByName) {
  const std::vector<OffsetSample> samples =
      readOffsets("stamp,offset_s,sigma_s\n1700000000.123456789,-0.009,0.001\n\n1700000000.2,0.01,2e-3\r\n");
  ASSERT_EQ(samples.size(), 2u);
  EXPECT_EQ(samples[0].time.nanoseconds(), 1700000000123456789);
  EXPECT_DOUBLE_EQ(samples[0].offset, -0.009);
  EXPECT_DOUBLE_EQ(samples[0].sigma, 0.001);
  EXPECT_DOUBLE_EQ(samples[1].offset, 0.01);
  const std::vector<OffsetSample> other =
      readOffsets("sigma_s, stamp, note, offset_s\n0.5, 3, hello, 0.25\n");
  ASSERT_EQ(other.size(), 1u);
  EXPECT_EQ(other[0].time, Time::fromSeconds(3));
  EXPECT_DOUBLE_EQ(other[0].offset, 0.25);
  EXPECT_DOUBLE_EQ(other[0].sigma, 0.5);
}

TEST(Offset, NamesFileLineAndExpectation) {
  const auto expectFailure = [](const std::string& text, const std::string& place,
                                const std::string& reason) {
    try {
      readOffsets(text);
      FAIL() << "accepted: " << text;
    } catch (const std::runtime_error& error) {
      EXPECT_TRUE(contains(error.what(), place)) << error.what();
      EXPECT_TRUE(contains(error.what(), reason)) << error.what();
    }
  };
  expectFailure("", "offset.csv:1: ", "no column 'stamp'");
  expectFailure("stamp,offset,sigma_s\n", "offset.csv:1: ", "no column 'offset_s'");
  expectFailure("stamp,offset_s,sigma_s\n1,2\n", "offset.csv:2: ", "found 2 columns");
  expectFailure("stamp,offset_s,sigma_s\n1,2,3\nx,2,3\n", "offset.csv:3: ", "'x' is not a time");
  expectFailure("stamp,offset_s,sigma_s\n1,,3\n", "offset.csv:2: ", "offset_s is ''");
  expectFailure("stamp,offset_s,sigma_s\n1,2,nan\n", "offset.csv:2: ", "sigma_s is 'nan'");
  expectFailure("stamp,offset_s,sigma_s\n1,2,0\n", "offset.csv:2: ", "not greater than zero");
}

TEST(Offset, ErrorsAndConsistencyOfAKnownSeries) {
  // Errors 0.5, -1.5, 2.5, -3.5 sigma of 1 ms about 10 ms.
  const std::vector<OffsetSample> samples = {
      {at(0), 0.0105, 0.001}, {at(1), 0.0085, 0.001}, {at(2), 0.0125, 0.001}, {at(3), 0.0065, 0.001}};
  const OffsetError error = offsetError(samples, 0.010);
  EXPECT_EQ(error.samples, 4u);
  EXPECT_NEAR(error.mean, -0.0005, 1e-12);
  EXPECT_NEAR(error.rmse, std::sqrt(5.25) * 1e-3, 1e-12);
  EXPECT_NEAR(error.max, 0.0035, 1e-12);
  EXPECT_NEAR(error.final_error, -0.0035, 1e-12);
  EXPECT_NEAR(error.final_sigma, 0.001, 1e-12);
  EXPECT_NEAR(error.share_1_sigma, 0.25, 1e-12);
  EXPECT_NEAR(error.share_2_sigma, 0.50, 1e-12);
  EXPECT_NEAR(error.share_3_sigma, 0.75, 1e-12);
  EXPECT_NEAR(error.mean_normalised_square, 5.25, 1e-9);
}

TEST(Offset, ConvergenceCanBeLeftOut) {
  const std::vector<OffsetSample> samples = {{at(0), 1.0, 0.1}, {at(1), 1.0, 0.1}, {at(2), 0.0, 0.1}};
  EXPECT_EQ(offsetError(samples, 0.0, 1.0).samples, 2u);
  EXPECT_EQ(offsetError(samples, 0.0, 1.5).rmse, 0.0);
  EXPECT_THROW(offsetError(samples, 0.0, 3.0), std::invalid_argument);
  EXPECT_THROW(offsetError({}, 0.0), std::invalid_argument);
}

}  // namespace
}  // namespace rio_t
