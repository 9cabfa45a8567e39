#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "rio_t/core/so3.h"
#include "rio_t/simulation/motions.h"
#include "rio_t/simulation/random.h"
#include "rio_t/simulation/trajectory_spline.h"
#include "simulation_setup.h"

namespace rio_t::simulation {
namespace {

TEST(Random, HasTheMomentsOfItsDistributions) {
  Random random(7);
  constexpr int kCount = 200000;
  double uniform = 0.0, mean = 0.0, square = 0.0, fourth = 0.0;
  for (int i = 0; i < kCount; ++i) {
    const double u = random.uniform();
    ASSERT_GE(u, 0.0);
    ASSERT_LT(u, 1.0);
    uniform += u / kCount;
    const double g = random.gaussian();
    mean += g / kCount;
    square += g * g / kCount;
    fourth += g * g * g * g / kCount;
  }
  // Five sigma of the estimate of each moment.
  EXPECT_NEAR(uniform, 0.5, 5.0 * std::sqrt(1.0 / 12.0 / kCount));
  EXPECT_NEAR(mean, 0.0, 5.0 * std::sqrt(1.0 / kCount));
  EXPECT_NEAR(square, 1.0, 5.0 * std::sqrt(2.0 / kCount));
  EXPECT_NEAR(fourth, 3.0, 5.0 * std::sqrt(96.0 / kCount));
}

TEST(Random, StreamsAndIndicesAreDifferentSequences) {
  const auto first = [](std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
    return Random(seed, stream, index).bits();
  };
  EXPECT_EQ(first(1, 2, 3), first(1, 2, 3));
  EXPECT_NE(first(1, 2, 3), first(2, 1, 3));
  EXPECT_NE(first(1, 2, 3), first(1, 3, 2));
  EXPECT_NE(first(1, 2, 3), first(3, 2, 1));
}

// A wiggly trajectory with large turns, `rate` poses a second for `duration` seconds.
Trajectory wiggle(double rate, double duration) {
  Trajectory poses;
  for (int i = 0; i <= static_cast<int>(rate * duration); ++i) {
    const double t = i / rate;
    StampedPose pose;
    pose.time = Time::fromNanoseconds(1'600'000'000'000'000'000) + t;
    pose.p_W = {std::sin(2.0 * t), 2.0 * std::cos(1.3 * t), 0.4 * std::sin(3.0 * t + 0.5)};
    pose.q_WI =
        so3::exp({0.5 * std::sin(2.5 * t), 0.7 * std::cos(1.7 * t), 0.0}) * so3::exp({0.0, 0.0, 1.5 * t});
    poses.push_back(pose);
  }
  return poses;
}

TEST(TrajectorySpline, DerivativesAreThoseOfItsPose) {
  const TrajectorySpline spline(wiggle(20.0, 10.0));
  const double h = 1e-4;
  for (double t = 0.1; t < 9.9; t += 0.0371) {
    const MotionState before = spline.at(t - h), now = spline.at(t), after = spline.at(t + h);
    // Central differences: error h^2/6 times the third derivative, some 1e-7 here.
    EXPECT_LT(((after.p_W - before.p_W) / (2.0 * h) - now.v_W).norm(), 1e-5) << t;
    EXPECT_LT(((after.v_W - before.v_W) / (2.0 * h) - now.a_W).norm(), 1e-5) << t;
    EXPECT_LT((so3::log(before.q_WI.conjugate() * after.q_WI) / (2.0 * h) - now.omega_I).norm(), 1e-5) << t;
  }
}

TEST(TrajectorySpline, AccelerationsAreContinuousAcrossKnots) {
  const TrajectorySpline spline(wiggle(20.0, 5.0));
  constexpr double kSpacing = TrajectorySpline::kKnotSpacing;
  for (double knot = kSpacing; knot < 4.9; knot += kSpacing) {
    const double eps = 1e-9;
    const MotionState left = spline.at(knot - eps), right = spline.at(knot + eps);
    EXPECT_LT((left.a_W - right.a_W).norm(), 1e-6) << knot;
  }
}

TEST(TrajectorySpline, PassesThroughSmoothPoses) {
  const Trajectory poses = wiggle(20.0, 10.0);
  const TrajectorySpline spline(poses);
  for (std::size_t i = 10; i + 10 < poses.size(); ++i) {
    const MotionState state = spline.at(poses[i].time - poses.front().time);
    EXPECT_LT((state.p_W - poses[i].p_W).norm(), 1e-4) << i;
    EXPECT_LT(state.q_WI.angularDistance(poses[i].q_WI), 1e-3) << i;
  }
  EXPECT_LT(spline.positionResidual(), 1e-3);
  EXPECT_LT(spline.rotationResidual(), 1e-2);
}

TEST(TrajectorySpline, SmoothingKeepsPoseNoiseOutOfTheAcceleration) {
  // 1 mm of noise at 100 Hz is about 15 m/s^2 (rms) in second differences.
  Trajectory poses = wiggle(100.0, 10.0);
  Random random(3);
  for (StampedPose& pose : poses) pose.p_W += 0.001 * random.gaussianVector();
  const TrajectorySpline noisy(poses);
  const TrajectorySpline clean(wiggle(100.0, 10.0));
  double square = 0.0;
  int count = 0;
  for (double t = 1.0; t < 9.0; t += 0.013, ++count)
    square += (noisy.at(t).a_W - clean.at(t).a_W).squaredNorm();
  // White noise of sigma^2 / rate [m^2/Hz, one sided: twice] through the low-pass and (2 pi f)^4: the
  // integral of 2 sigma^2 / rate (2 pi f)^4 over 0..5 Hz is (0.28 m/s^2)^2 an axis, 0.48 for three; the
  // filter's own edge is a little wider or narrower than that rectangle.
  EXPECT_LT(std::sqrt(square / count), 0.55);
  EXPECT_GT(std::sqrt(square / count), 0.1);
}

TEST(TrajectorySpline, QuaternionsMayChangeSign) {
  Trajectory poses = wiggle(20.0, 10.0);
  const TrajectorySpline spline(poses);
  for (std::size_t i = 0; i < poses.size(); i += 2) poses[i].q_WI.coeffs() *= -1.0;
  const TrajectorySpline flipped(poses);
  for (double t = 0.0; t < 10.0; t += 0.1) {
    EXPECT_LT((spline.at(t).omega_I - flipped.at(t).omega_I).norm(), 1e-12) << t;
  }
}

TEST(TrajectorySpline, RefusesWhatItCannotFollow) {
  EXPECT_THROW(TrajectorySpline(Trajectory{}), std::invalid_argument);
  Trajectory poses = wiggle(20.0, 1.0);
  poses.resize(3);
  EXPECT_THROW(TrajectorySpline{poses}, std::invalid_argument);
  poses = wiggle(20.0, 1.0);
  poses[5].time = poses[4].time;
  EXPECT_THROW(TrajectorySpline{poses}, std::invalid_argument);
  poses = wiggle(20.0, 1.0);
  poses[5].q_WI = poses[5].q_WI * so3::exp({0.0, 0.0, 2.0});
  EXPECT_THROW(TrajectorySpline{poses}, std::invalid_argument);
  const TrajectorySpline spline(wiggle(20.0, 1.0));
  EXPECT_THROW(spline.at(-0.01), std::out_of_range);
  EXPECT_THROW(spline.at(spline.duration() + 0.01), std::out_of_range);
}

TEST(Motion, DerivativesHoldThroughRestAndRamps) {
  const Motion motion = builtIn("difficult");
  const double h = 1e-4;
  for (double t = h; t < motion.duration() - h; t += 0.0231) {
    const MotionState before = motion.at(t - h), now = motion.at(t), after = motion.at(t + h);
    ASSERT_LT(((after.p_W - before.p_W) / (2.0 * h) - now.v_W).norm(), 2e-5) << t;
    ASSERT_LT(((after.v_W - before.v_W) / (2.0 * h) - now.a_W).norm(), 2e-4) << t;
    ASSERT_LT((so3::log(before.q_WI.conjugate() * after.q_WI) / (2.0 * h) - now.omega_I).norm(), 2e-5) << t;
  }
}

struct Peaks {
  double speed = 0.0, rate = 0.0, acceleration = 0.0;
};

Peaks peaksOf(const Motion& motion) {
  Peaks peaks;
  for (double t = 0.0; t <= motion.duration(); t += 0.01) {
    const MotionState state = motion.at(t);
    peaks.speed = std::max(peaks.speed, state.v_W.norm());
    peaks.rate = std::max(peaks.rate, state.omega_I.norm());
    peaks.acceleration = std::max(peaks.acceleration, state.a_W.norm());
  }
  return peaks;
}

class EveryMotion : public testing::TestWithParam<MotionDescription> {};

TEST_P(EveryMotion, RestsExactlyAtBothEndsAndLastsAsLongAsItSays) {
  const Motion motion = builtIn(GetParam().name);
  EXPECT_NEAR(motion.duration(), GetParam().default_duration, 1e-6);
  const double start = GetParam().name == "start_in_motion" ? 0.0 : 12.0;
  const MotionState first = motion.at(0.0);
  const MotionState last = motion.at(motion.duration());
  for (double t = 0.0; t < start; t += 0.05) {
    const MotionState state = motion.at(t);
    ASSERT_EQ(state.v_W.norm() + state.a_W.norm() + state.omega_I.norm(), 0.0) << t;
    ASSERT_EQ(state.p_W, first.p_W) << t;
  }
  for (double t = motion.duration() - 3.0 + 1e-6; t < motion.duration(); t += 0.05) {
    const MotionState state = motion.at(t);
    ASSERT_EQ(state.v_W.norm() + state.a_W.norm() + state.omega_I.norm(), 0.0) << t;
    ASSERT_EQ(state.p_W, last.p_W) << t;
  }
  EXPECT_GT(motion.at(start + 2.0).v_W.norm(), 0.01);
}

TEST_P(EveryMotion, IsAFunctionOfNameAndSeed) {
  const Motion motion = builtIn(GetParam().name, 5);
  const Motion same = builtIn(GetParam().name, 5);
  const Motion other = builtIn(GetParam().name, 6);
  EXPECT_EQ(motion.at(40.0).p_W, same.at(40.0).p_W);
  EXPECT_EQ(motion.at(40.0).q_WI.coeffs(), same.at(40.0).q_WI.coeffs());
  if (GetParam().name != "constant_speed") {
    EXPECT_NE(motion.at(40.0).p_W, other.at(40.0).p_W);
  }
}

INSTANTIATE_TEST_SUITE_P(Motions, EveryMotion, testing::ValuesIn(builtInMotions()),
                         [](const auto& test) { return test.param.name; });

TEST(Motions, ReachWhatTheirNamesPromise) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const Peaks easy = peaksOf(builtIn("easy", seed));
    EXPECT_NEAR(easy.speed, 0.7, 0.1);
    EXPECT_NEAR(easy.rate, 0.5, 0.1);
    const Peaks medium = peaksOf(builtIn("medium", seed));
    EXPECT_NEAR(medium.speed, 1.0, 0.15);
    EXPECT_NEAR(medium.rate, 1.0, 0.15);
    const Peaks difficult = peaksOf(builtIn("difficult", seed));
    EXPECT_NEAR(difficult.speed, 2.0, 0.2);
    EXPECT_NEAR(difficult.rate, 3.0, 0.3);
    EXPECT_GT(difficult.acceleration, 5.0);
    EXPECT_NEAR(peaksOf(builtIn("drone", seed)).speed, 3.0, 0.3);
    EXPECT_NEAR(peaksOf(builtIn("ground_vehicle", seed)).speed, 5.0, 0.5);
  }
}

TEST(Motions, HaveTheirCharacter) {
  const Motion gym = builtIn("gym_loop");
  EXPECT_LT((gym.at(0.0).p_W - gym.at(gym.duration()).p_W).norm(), 2.0);
  EXPECT_GT(gym.at(50.0).p_W.norm(), 5.0);

  const Motion vehicle = builtIn("ground_vehicle");
  const Motion straight = builtIn("constant_speed");
  for (double t = 15.0; t < 84.0; t += 0.1) {
    const MotionState v = vehicle.at(t);
    EXPECT_LT(std::abs(v.p_W.z()), 1e-6);
    // No side slip.
    EXPECT_LT(std::abs((v.q_WI.conjugate() * v.v_W).y()), 0.02) << t;
    const MotionState c = straight.at(t);
    EXPECT_NEAR(c.v_W.norm(), 1.0, 1e-6);
    EXPECT_LT(c.omega_I.norm() + c.a_W.norm(), 1e-6);
  }
  EXPECT_GT(builtIn("start_in_motion").at(0.0).v_W.norm(), 0.05);
}

TEST(Motions, AWalkIsLongAndTurnsAndSteps) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const Motion motion = builtIn("walk", seed);
    const double from = 14.0, until = motion.duration() - 5.0;  // at full speed
    double length = 0.0, low = 1e9, high = -1e9, path_to_last_turn = 0.0, yaw_rate = 0.0;
    int steps = 0, turns = 0;
    double vertical_speed = 0.0;
    constexpr double kStep = 0.01;
    for (double t = from; t < until; t += kStep) {
      const MotionState state = motion.at(t);
      length += kStep * state.v_W.head<2>().norm();
      low = std::min(low, state.p_W.z());
      high = std::max(high, state.p_W.z());
      ASSERT_LT(std::acos(std::min(1.0, (state.q_WI * Eigen::Vector3d::UnitZ()).z())), 0.3) << t;
      // Looks where it goes.
      ASSERT_GT((state.q_WI.conjugate() * state.v_W).normalized().x(), 0.9) << t;
      if (vertical_speed < 0.0 && state.v_W.z() >= 0.0) ++steps;
      vertical_speed = state.v_W.z();
      // Sway alone stays far below.
      if (std::abs(yaw_rate) < 0.5 && std::abs(state.omega_I.z()) >= 0.5) {
        if (turns++ > 0) {
          EXPECT_GT(length - path_to_last_turn, 4.5) << t;
          EXPECT_LT(length - path_to_last_turn, 21.0) << t;
        }
        path_to_last_turn = length;
      }
      yaw_rate = state.omega_I.z();
    }
    EXPECT_NEAR(length, 345.0, 15.0);
    EXPECT_NEAR(length / (until - from), 1.25, 0.05);
    EXPECT_NEAR(steps / (until - from), 2.0, 0.05);
    EXPECT_NEAR(high - low, 0.025, 0.002);
    EXPECT_GT(turns, 20);
    const Peaks peaks = peaksOf(motion);
    EXPECT_NEAR(peaks.rate, 1.0, 0.15);
    EXPECT_LT(peaks.speed, 1.7);
    // 0.0125 m at 4 pi rad/s are 2 m/s^2 upwards.
    EXPECT_GT(peaks.acceleration, 1.8);
    EXPECT_LT(peaks.acceleration, 3.0);
  }
}

TEST(Motions, ConstantSpeedKeepsTheSpeedItIsGiven) {
  for (const double speed : {0.2, 5.0, 20.0}) {
    const Motion motion = makeMotion({"constant_speed", 1, 0.0, MotionRestOptions{}, speed});
    EXPECT_NEAR(motion.duration(), 90.0, 1e-6);
    for (double t = 14.5; t < 84.5; t += 0.1) {
      const MotionState state = motion.at(t);
      ASSERT_NEAR(state.v_W.x(), speed, 1e-6 * speed) << t;
      ASSERT_LT(state.v_W.tail<2>().norm() + state.omega_I.norm(), 1e-9) << t;
    }
    // Two ramps of 2 s at half of the speed.
    EXPECT_NEAR(motion.at(90.0).p_W.x(), speed * 73.0, 1e-6 * speed * 73.0);
  }
}

TEST(Motions, AWalkTakesAnotherPace) {
  const auto mean_speed = [](const Motion& motion) {
    double length = 0.0;
    const double from = 14.0, until = motion.duration() - 5.0;  // at full speed
    for (double t = from; t < until; t += 0.01) length += 0.01 * motion.at(t).v_W.head<2>().norm();
    return length / (until - from);
  };
  const MotionRestOptions rest;
  // Turns, which are slower, fill more of a faster walk.
  EXPECT_NEAR(mean_speed(makeMotion({"walk", 1, 150.0, rest, 2.4})), 2.2, 0.1);
  EXPECT_EQ(makeMotion({"walk", 1, 150.0, rest, 1.3}).at(100.0).p_W, builtIn("walk", 1, 150.0).at(100.0).p_W);
}

TEST(Motions, AKartBrakesBeforeItsBendsOnAFlatFloor) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const Motion motion = builtIn("kart", seed);
    double length = 0.0, left = 0.0, right = 0.0, hardest_braking = 0.0, hardest_pull = 0.0;
    for (double t = 0.0; t < motion.duration(); t += 0.01) {
      const MotionState state = motion.at(t);
      const Eigen::Vector3d v_I = state.q_WI.conjugate() * state.v_W;
      const double forward = (state.q_WI.conjugate() * state.a_W).x();
      length += 0.01 * state.v_W.norm();
      ASSERT_LT(std::abs(state.p_W.z()), 1e-6) << t;
      ASSERT_LT(std::abs(v_I.y()), 0.02) << t;  // no side slip
      ASSERT_LT(state.v_W.norm(), 3.0) << t;
      if (t > 14.0 && t < motion.duration() - 5.0) {
        ASSERT_GT(state.v_W.norm(), 1.0) << t;
        hardest_braking = std::min(hardest_braking, forward);
        hardest_pull = std::max(hardest_pull, forward);
      }
      (state.omega_I.z() > 0.0 ? left : right) += 0.01 * std::abs(state.omega_I.z());
    }
    EXPECT_NEAR(length, 120.0, 10.0) << seed;
    EXPECT_GT(left, 6.28);   // a lap and more
    EXPECT_GT(right, 6.28);  // and a loop the other way
    EXPECT_LT(hardest_braking, -0.8);
    EXPECT_GT(hardest_pull, 0.8);
  }
}

TEST(Motions, SpeedIsRefusedWhereItMeansNothing) {
  for (const MotionDescription& motion : builtInMotions()) {
    if (motion.name == "constant_speed" || motion.name == "walk") continue;
    EXPECT_THROW(makeMotion({motion.name, 1, 0.0, MotionRestOptions{}, 2.0}), std::invalid_argument);
  }
  EXPECT_THROW(makeMotion({"constant_speed", 1, 0.0, MotionRestOptions{}, 0.0}), std::invalid_argument);
  EXPECT_THROW(makeMotion({"constant_speed", 1, 0.0, MotionRestOptions{}, -1.0}), std::invalid_argument);
}

TEST(Motions, UnknownNameAndTooShortDurationAreRefused) {
  EXPECT_THROW(builtIn("waltz"), std::invalid_argument);
  EXPECT_THROW(builtIn("easy", 1, 18.0), std::invalid_argument);
  EXPECT_NEAR(builtIn("easy", 1, 30.0).duration(), 30.0, 1e-6);
}

}  // namespace
}  // namespace rio_t::simulation
