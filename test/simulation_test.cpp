#include "rio_t/simulation/simulation.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "rio_t/core/so3.h"
#include "rio_t/simulation/motions.h"
#include "rio_t/simulation/presets.h"
#include "rio_t/simulation/random.h"

namespace rio_t::simulation {
namespace {

constexpr double kGravity = 9.81;

Motion builtIn(const std::string& name, std::uint64_t seed = 1, double duration = 0.0) {
  return makeMotion({name, seed, duration, MotionRestOptions{}});
}

SimulationOptions withoutErrors() {
  SimulationOptions options;
  options.imu.removeErrors();
  options.radar.removeErrors();
  return options;
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

// --- Random numbers
// --------------------------------------------------------------------------------------------

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

// --- Spline
// ----------------------------------------------------------------------------------------------------

TEST(TrajectorySpline, DerivativesAreThoseOfItsPose) {
  const TrajectorySpline spline(wiggle(20.0, 10.0));
  const double h = 1e-4;
  for (double t = 0.1; t < 9.9; t += 0.0371) {
    const MotionState before = spline.at(t - h), now = spline.at(t), after = spline.at(t + h);
    // Central differences: error h^2/6 times the third derivative, some 1e-7 here.
    EXPECT_LT(((after.p_W - before.p_W) / (2.0 * h) - now.v_W).norm(), 1e-5) << t;
    EXPECT_LT(((after.v_W - before.v_W) / (2.0 * h) - now.a_W).norm(), 1e-5) << t;
    EXPECT_LT((so3::log(before.q_WI.conjugate() * after.q_WI) / (2.0 * h) - now.omega_I).norm(), 1e-5) << t;
    EXPECT_LT(((after.omega_I - before.omega_I) / (2.0 * h) - now.alpha_I).norm(), 1e-5) << t;
  }
}

TEST(TrajectorySpline, SecondDerivativesAreContinuousAcrossKnots) {
  SplineFitOptions options;
  const TrajectorySpline spline(wiggle(20.0, 5.0), options);
  for (double knot = options.knot_spacing; knot < 4.9; knot += options.knot_spacing) {
    const double eps = 1e-9;
    const MotionState left = spline.at(knot - eps), right = spline.at(knot + eps);
    EXPECT_LT((left.a_W - right.a_W).norm(), 1e-6) << knot;
    EXPECT_LT((left.alpha_I - right.alpha_I).norm(), 1e-6) << knot;
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

// --- Motions
// ---------------------------------------------------------------------------------------------------

TEST(Motion, DerivativesHoldThroughRestAndRamps) {
  const Motion motion = builtIn("difficult");
  const double h = 1e-4;
  for (double t = h; t < motion.duration() - h; t += 0.0231) {
    const MotionState before = motion.at(t - h), now = motion.at(t), after = motion.at(t + h);
    ASSERT_LT(((after.p_W - before.p_W) / (2.0 * h) - now.v_W).norm(), 2e-5) << t;
    ASSERT_LT(((after.v_W - before.v_W) / (2.0 * h) - now.a_W).norm(), 2e-4) << t;
    ASSERT_LT((so3::log(before.q_WI.conjugate() * after.q_WI) / (2.0 * h) - now.omega_I).norm(), 2e-5) << t;
    ASSERT_LT(((after.omega_I - before.omega_I) / (2.0 * h) - now.alpha_I).norm(), 2e-4) << t;
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
    ASSERT_EQ(state.v_W.norm() + state.a_W.norm() + state.omega_I.norm() + state.alpha_I.norm(), 0.0) << t;
    ASSERT_EQ(state.p_W, first.p_W) << t;
  }
  for (double t = motion.duration() - 3.0 + 1e-6; t < motion.duration(); t += 0.05) {
    const MotionState state = motion.at(t);
    ASSERT_EQ(state.v_W.norm() + state.a_W.norm() + state.omega_I.norm() + state.alpha_I.norm(), 0.0) << t;
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

// --- IMU
// -------------------------------------------------------------------------------------------------------

struct Reckoned {
  Eigen::Vector3d p_W, v_W;
  Eigen::Quaterniond q_WI;
};

// Dead reckoning by the midpoint rule: the mean of neighbouring samples stands for the interval.
Reckoned integrate(const std::vector<ImuMeasurement>& samples, const MotionState& start) {
  Reckoned s{start.p_W, start.v_W, start.q_WI};
  const Eigen::Vector3d g_W(0.0, 0.0, -kGravity);
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const ImuMeasurement& a = samples[i - 1];
    const ImuMeasurement& b = samples[i];
    const double dt = b.time - a.time;
    const Eigen::Quaterniond next =
        (s.q_WI * so3::exp(0.5 * dt * (a.angular_velocity + b.angular_velocity))).normalized();
    const Eigen::Vector3d a_W = 0.5 * (s.q_WI * a.acceleration + next * b.acceleration) + g_W;
    s.p_W += dt * s.v_W + 0.5 * dt * dt * a_W;
    s.v_W += dt * a_W;
    s.q_WI = next;
  }
  return s;
}

TEST(ImuModel, NoiseFreeImuIntegratesToTheTruth) {
  // 8 kHz: the error of the midpoint rule falls with the square of the step; here it is 0.7 mm after 60 s of
  // motion that follow 12 s of rest (at 4 kHz four times that, at the 409 Hz of a bag 0.27 m).
  const Motion motion = builtIn("difficult", 1, 77.0);
  ImuModelOptions options;
  options.removeErrors();
  options.rate = 8000.0;
  const ImuData imu = simulateImu(motion, options, 1, Time::fromNanoseconds(1'700'000'000'000'000'000));
  const Reckoned end = integrate(imu.samples, motion.at(0.0));
  const MotionState truth = motion.at(imu.samples.back().time - imu.samples.front().time);
  EXPECT_LT((end.p_W - truth.p_W).norm(), 0.001);
  EXPECT_LT((end.v_W - truth.v_W).norm(), 1e-4);
  EXPECT_LT(end.q_WI.angularDistance(truth.q_WI), 1e-6);
}

TEST(ImuModel, NoiseFreeImuAtTheRateOfABagIntegratesToTheTruth) {
  // Runge and Kutta's fourth order over pairs of samples, so that 409 Hz are enough.
  const Motion motion = builtIn("difficult", 3, 77.0);
  ImuModelOptions options;
  options.removeErrors();
  const std::vector<ImuMeasurement> samples = simulateImu(motion, options, 1, Time()).samples;
  const Eigen::Vector3d g_W(0.0, 0.0, -kGravity);
  const auto rotationRate = [](const Eigen::Vector4d& q, const Eigen::Vector3d& omega_I) -> Eigen::Vector4d {
    return 0.5 *
           (Eigen::Quaterniond(q) * Eigen::Quaterniond(0.0, omega_I.x(), omega_I.y(), omega_I.z())).coeffs();
  };
  const auto acceleration = [&](const Eigen::Vector4d& q, const Eigen::Vector3d& f_I) -> Eigen::Vector3d {
    return Eigen::Quaterniond(q).normalized() * f_I + g_W;
  };
  const MotionState start = motion.at(0.0);
  Eigen::Vector3d p = start.p_W, v = start.v_W;
  Eigen::Vector4d q = start.q_WI.coeffs();
  std::size_t i = 0;
  for (; i + 2 < samples.size(); i += 2) {
    const ImuMeasurement &first = samples[i], &middle = samples[i + 1], &last = samples[i + 2];
    const double h = last.time - first.time;
    const Eigen::Vector4d k1 = rotationRate(q, first.angular_velocity);
    const Eigen::Vector4d q2 = q + 0.5 * h * k1;
    const Eigen::Vector4d k2 = rotationRate(q2, middle.angular_velocity);
    const Eigen::Vector4d q3 = q + 0.5 * h * k2;
    const Eigen::Vector4d k3 = rotationRate(q3, middle.angular_velocity);
    const Eigen::Vector4d q4 = q + h * k3;
    const Eigen::Vector4d k4 = rotationRate(q4, last.angular_velocity);
    const Eigen::Vector3d a1 = acceleration(q, first.acceleration);
    const Eigen::Vector3d a2 = acceleration(q2, middle.acceleration);
    const Eigen::Vector3d a3 = acceleration(q3, middle.acceleration);
    const Eigen::Vector3d a4 = acceleration(q4, last.acceleration);
    p += h * v + h * h / 6.0 * (a1 + a2 + a3);
    v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
    q = (q + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)).normalized();
  }
  const MotionState truth = motion.at(samples[i].time - samples.front().time);
  EXPECT_LT((p - truth.p_W).norm(), 1e-5);
  EXPECT_LT((v - truth.v_W).norm(), 1e-6);
}

TEST(ImuModel, NoiseFreeImuIntegratesToTheTruthFromAStartInMotion) {
  const Motion motion = builtIn("start_in_motion", 2, 63.0);
  ImuModelOptions options;
  options.removeErrors();
  options.rate = 8000.0;
  const ImuData imu = simulateImu(motion, options, 1, Time());
  const Reckoned end = integrate(imu.samples, motion.at(0.0));
  const MotionState truth = motion.at(imu.samples.back().time - imu.samples.front().time);
  EXPECT_LT((end.p_W - truth.p_W).norm(), 0.001);
  EXPECT_LT(end.q_WI.angularDistance(truth.q_WI), 1e-6);
}

TEST(ImuModel, NoiseAndBiasWalkHaveTheirDensities) {
  const Motion motion = builtIn("easy");
  ImuModelOptions options;
  options.noise.accel_random_walk = 1e-2;
  options.noise.gyro_random_walk = 1e-3;
  const ImuData imu = simulateImu(motion, options, 3, Time());
  double accel = 0.0, gyro = 0.0, walk_a = 0.0, walk_g = 0.0;
  for (std::size_t i = 1; i < imu.samples.size(); ++i) {
    const MotionState state = motion.at(imu.samples[i].time - Time());
    const Eigen::Vector3d f_I = state.q_WI.conjugate() * (state.a_W + Eigen::Vector3d(0.0, 0.0, kGravity));
    accel += (imu.samples[i].acceleration - f_I - imu.b_a[i]).squaredNorm();
    gyro += (imu.samples[i].angular_velocity - state.omega_I - imu.b_g[i]).squaredNorm();
    walk_a += (imu.b_a[i] - imu.b_a[i - 1]).squaredNorm();
    walk_g += (imu.b_g[i] - imu.b_g[i - 1]).squaredNorm();
  }
  // Densities back from the samples; 1e5 numbers give them to 0.2 %, five sigma of that is 1 %.
  const double n = 3.0 * static_cast<double>(imu.samples.size() - 1);
  EXPECT_NEAR(std::sqrt(accel / n / options.rate), options.noise.accel_density,
              0.012 * options.noise.accel_density);
  EXPECT_NEAR(std::sqrt(gyro / n / options.rate), options.noise.gyro_density,
              0.012 * options.noise.gyro_density);
  EXPECT_NEAR(std::sqrt(walk_a / n * options.rate), 1e-2, 1.2e-4);
  EXPECT_NEAR(std::sqrt(walk_g / n * options.rate), 1e-3, 1.2e-5);
}

// What the vibration adds to the samples of 400 s of rest: those with it minus those without it.
std::vector<ImuMeasurement> vibrationAtRest(const ImuModelOptions& vibrating) {
  MotionRestOptions rest;
  rest.static_start = 400.0;
  const Motion motion = makeMotion({"easy", 1, 420.0, rest});
  ImuModelOptions still = vibrating;
  still.accel_vibration = still.gyro_vibration = still.vibration_frequency = 0.0;
  const ImuData without = simulateImu(motion, still, 3, Time());
  std::vector<ImuMeasurement> samples = simulateImu(motion, vibrating, 3, Time()).samples;
  samples.resize(static_cast<std::size_t>(400.0 * vibrating.rate));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    samples[i].acceleration -= without.samples[i].acceleration;
    samples[i].angular_velocity -= without.samples[i].angular_velocity;
  }
  return samples;
}

struct Sigmas {
  double accel = 0.0, gyro = 0.0;
};

Sigmas sigmasOf(const std::vector<ImuMeasurement>& samples) {
  Sigmas squares;
  for (const ImuMeasurement& sample : samples) {
    squares.accel += sample.acceleration.squaredNorm();
    squares.gyro += sample.angular_velocity.squaredNorm();
  }
  const double n = 3.0 * static_cast<double>(samples.size());
  return {std::sqrt(squares.accel / n), std::sqrt(squares.gyro / n)};
}

// Share of the accelerometer's power within `reach` [Hz] of `frequency`, over all stretches of 20 s.
double shareOfPower(const std::vector<ImuMeasurement>& samples, double rate, double frequency, double reach) {
  constexpr double kStretch = 20.0;  // [s]; lines of its spectrum are 1 / 20 Hz apart
  const auto n = static_cast<std::size_t>(kStretch * rate);
  double inside = 0.0, all = 0.0;
  for (std::size_t first = 0; first + n <= samples.size(); first += n) {
    for (std::size_t i = first; i < first + n; ++i) all += samples[i].acceleration.squaredNorm();
    const double step = rate / static_cast<double>(n);
    const int lines = static_cast<int>(std::lround(reach / step));
    for (int line = -lines; line <= lines; ++line) {
      const double turn = 2.0 * 3.141592653589793 * (std::round(frequency / step) + line) * step / rate;
      const double c = std::cos(turn), s = std::sin(turn);
      Eigen::Vector3d in_phase = Eigen::Vector3d::Zero(), quadrature = Eigen::Vector3d::Zero();
      double x = 1.0, y = 0.0;
      for (std::size_t i = first; i < first + n; ++i) {
        in_phase += x * samples[i].acceleration;
        quadrature += y * samples[i].acceleration;
        const double turned = c * x - s * y;
        y = s * x + c * y;
        x = turned;
      }
      // Parseval; twice, because half of the power is at the negative frequency.
      inside += 2.0 * (in_phase.squaredNorm() + quadrature.squaredNorm()) / static_cast<double>(n);
    }
  }
  return inside / all;
}

TEST(ImuModel, WhiteVibrationHasItsSigmaAtRestAndNoLine) {
  ImuModelOptions options;
  options.accel_vibration = 3.0;
  options.gyro_vibration = 0.2;
  const std::vector<ImuMeasurement> vibration = vibrationAtRest(options);
  const Sigmas sigmas = sigmasOf(vibration);
  // 490800 numbers give a sigma to 0.1 %; five times that.
  EXPECT_NEAR(sigmas.accel, 3.0, 0.005 * 3.0);
  EXPECT_NEAR(sigmas.gyro, 0.2, 0.005 * 0.2);
  double product = 0.0;
  for (std::size_t i = 1; i < vibration.size(); ++i) {
    product += vibration[i].acceleration.dot(vibration[i - 1].acceleration);
  }
  EXPECT_NEAR(product / (3.0 * static_cast<double>(vibration.size())) / 9.0, 0.0, 0.0075);
  EXPECT_NEAR(shareOfPower(vibration, options.rate, 60.0, 2.0), 4.05 / (0.5 * options.rate), 0.003);
}

TEST(ImuModel, NarrowVibrationHasItsSigmaAtRestAndItsFrequency) {
  // 300 Hz are seen at 409 - 300.
  for (const auto& [frequency, seen] : {std::pair(60.0, 60.0), std::pair(300.0, 109.0)}) {
    ImuModelOptions options;
    options.accel_vibration = 3.0;
    options.gyro_vibration = 0.2;
    options.vibration_frequency = frequency;
    const std::vector<ImuMeasurement> vibration = vibrationAtRest(options);
    const Sigmas sigmas = sigmasOf(vibration);
    // Squares stay alike for a quarter of a second: 4800 free numbers give a sigma to 1 %; five times that.
    EXPECT_NEAR(sigmas.accel, 3.0, 0.05 * 3.0) << frequency;
    EXPECT_NEAR(sigmas.gyro, 0.2, 0.05 * 0.2) << frequency;
    // Within its reach a Lorentz line of coherence T holds 2 / pi atan(2 pi T reach) of the power: 0.96, and
    // 0.39 with half a line of the spectrum more at both ends. A steady tone would hold all of it.
    EXPECT_NEAR(shareOfPower(vibration, options.rate, seen, 5.0), 0.96, 0.02) << frequency;
    EXPECT_NEAR(shareOfPower(vibration, options.rate, seen, 0.2), 0.39, 0.06) << frequency;
    EXPECT_LT(shareOfPower(vibration, options.rate, seen + 30.0, 5.0), 0.02) << frequency;
  }
}

TEST(ImuModel, VibrationLeavesAllOtherNoiseAsItWas) {
  const Motion motion = builtIn("medium", 1, 30.0);
  SimulationOptions options;
  const SensorData still = simulate(motion, options);
  for (const double frequency : {0.0, 60.0}) {
    options.imu.vibration_frequency = frequency;
    options.imu.accel_vibration = 3.0;
    options.imu.gyro_vibration = 0.0;
    const SensorData accel = simulate(motion, options);
    options.imu.accel_vibration = 0.0;
    options.imu.gyro_vibration = 0.2;
    const SensorData gyro = simulate(motion, options);
    options.imu.accel_vibration = 3.0;
    const SensorData both = simulate(motion, options);
    for (std::size_t i = 0; i < still.imu.samples.size(); ++i) {
      // Noise of both sensors and walks of both biases come in turn from one sequence: one draw more or less
      // would shift all that follow.
      ASSERT_EQ(accel.imu.samples[i].angular_velocity, still.imu.samples[i].angular_velocity) << i;
      ASSERT_EQ(gyro.imu.samples[i].acceleration, still.imu.samples[i].acceleration) << i;
      ASSERT_NE(accel.imu.samples[i].acceleration, still.imu.samples[i].acceleration) << i;
      ASSERT_NE(gyro.imu.samples[i].angular_velocity, still.imu.samples[i].angular_velocity) << i;
      ASSERT_EQ(both.imu.samples[i].acceleration, accel.imu.samples[i].acceleration) << i;
      ASSERT_EQ(both.imu.samples[i].angular_velocity, gyro.imu.samples[i].angular_velocity) << i;
      ASSERT_EQ(both.imu.b_a[i], still.imu.b_a[i]) << i;
      ASSERT_EQ(both.imu.b_g[i], still.imu.b_g[i]) << i;
    }
    ASSERT_EQ(both.scans.size(), still.scans.size());
    EXPECT_EQ(both.scans.back().points.back().doppler, still.scans.back().points.back().doppler);
  }
  options.imu.removeErrors();
  const MotionState state = motion.at(20.0);
  const ImuMeasurement exact = simulateImu(motion, options.imu, 1, Time()).samples[8180];
  EXPECT_LT((exact.angular_velocity - state.omega_I).norm(), 1e-12);
}

TEST(ImuModel, RefusesNegativeVibration) {
  const Motion motion = builtIn("easy", 1, 30.0);
  ImuModelOptions options;
  options.accel_vibration = -1.0;
  EXPECT_THROW(simulateImu(motion, options, 1, Time()), std::invalid_argument);
  options = ImuModelOptions{};
  options.gyro_vibration = -0.1;
  EXPECT_THROW(simulateImu(motion, options, 1, Time()), std::invalid_argument);
  options = ImuModelOptions{};
  options.vibration_frequency = -60.0;
  EXPECT_THROW(simulateImu(motion, options, 1, Time()), std::invalid_argument);
}

TEST(ImuModel, DefaultNoiseIsTheMeasuredOneWhateverTheEstimatorExpects) {
  const ImuModelOptions options;
  EXPECT_EQ(options.noise.accel_density, 2.4e-3);
  EXPECT_EQ(options.noise.gyro_density, 2.0e-4);
  EXPECT_EQ(options.noise.accel_random_walk, 1.0e-4);
  EXPECT_EQ(options.noise.gyro_random_walk, 4.0e-6);
}

TEST(ImuModel, SaturatesPerAxis) {
  const Motion motion = builtIn("difficult");
  ImuModelOptions options;
  options.accel_saturation = 9.0;
  options.gyro_saturation = 1.0;
  double accel = 0.0, gyro = 0.0;
  for (const ImuMeasurement& sample : simulateImu(motion, options, 1, Time()).samples) {
    accel = std::max(accel, sample.acceleration.cwiseAbs().maxCoeff());
    gyro = std::max(gyro, sample.angular_velocity.cwiseAbs().maxCoeff());
  }
  EXPECT_EQ(accel, 9.0);
  EXPECT_EQ(gyro, 1.0);
}

TEST(ImuModel, StampsFollowTheRate) {
  const Motion motion = builtIn("easy", 1, 30.0);
  ImuModelOptions options;
  options.rate = 200.0;
  const Time start = Time::fromNanoseconds(1'700'000'000'000'000'000);
  const ImuData imu = simulateImu(motion, options, 1, start);
  ASSERT_EQ(imu.samples.size(), 6001u);
  EXPECT_EQ(imu.samples.front().time, start);
  EXPECT_EQ(imu.samples[1].time.nanoseconds() - start.nanoseconds(), 5'000'000);
  EXPECT_EQ(imu.samples.back().time.nanoseconds() - start.nanoseconds(), 30'000'000'000);
}

// --- Radar
// -----------------------------------------------------------------------------------------------------

// Least squares over all points of a scan, without weights: exact for exact points.
Eigen::Vector3d leastSquaresVelocity(const SimulatedScan& scan) {
  Eigen::MatrixXd H(static_cast<Eigen::Index>(scan.points.size()), 3);
  Eigen::VectorXd y(H.rows());
  for (Eigen::Index i = 0; i < H.rows(); ++i) {
    const SimulatedPoint& point = scan.points[static_cast<std::size_t>(i)];
    H.row(i) = -point.position_R.normalized().transpose();
    y[i] = point.doppler;
  }
  return H.colPivHouseholderQr().solve(y);
}

// Truth by the formula of the method notes, written out here again.
Eigen::Vector3d expectedVelocity(const MotionState& s, const Extrinsics& T_IR) {
  const Eigen::Matrix3d R_IW = s.q_WI.toRotationMatrix().transpose();
  const Eigen::Matrix3d R_RI = T_IR.q_IR.toRotationMatrix().transpose();
  return R_RI * (R_IW * s.v_W + so3::hat(s.omega_I) * T_IR.l_I);
}

void expectExactEgoVelocity(const Motion& motion, const SimulationOptions& options) {
  const SensorData data = simulate(motion, options);
  ASSERT_GT(data.scans.size(), 100u);
  for (const SimulatedScan& scan : data.scans) {
    const double stamp = scan.stamp - options.start;
    const double offset = options.time_offset.at(stamp);
    EXPECT_NEAR(scan.time_offset, offset, 1e-9);
    const Eigen::Vector3d truth = expectedVelocity(motion.at(stamp - offset), options.T_IR);
    ASSERT_LT((leastSquaresVelocity(scan) - truth).norm(), 1e-6) << "stamp " << stamp;
    ASSERT_LT((scan.v_R - truth).norm(), 1e-6) << "stamp " << stamp;
  }
}

TEST(RadarModel, NoiseFreeEgoVelocityIsTheTrueOneAtTheMeasurementTime) {
  SimulationOptions options = withoutErrors();
  for (const double offset : {0.0, -0.00925, 0.1}) {
    options.time_offset.constant = offset;
    expectExactEgoVelocity(builtIn("difficult"), options);
  }
}

TEST(RadarModel, NoiseFreeEgoVelocityIsTheTrueOneWithAnotherMounting) {
  SimulationOptions options = withoutErrors();
  options.T_IR.l_I = {0.5, -0.2, 0.3};
  options.T_IR.q_IR = Eigen::Quaterniond(0.8, -0.3, 0.4, 0.1).normalized();
  options.time_offset.constant = 0.03;
  expectExactEgoVelocity(builtIn("difficult", 2), options);
}

TEST(RadarModel, FollowsADriftingAndSteppingOffset) {
  SimulationOptions options = withoutErrors();
  options.time_offset.constant = 0.01;
  options.time_offset.drift = 2e-4;
  options.time_offset.steps = {{40.0, 0.03}, {60.0, -0.05}};
  EXPECT_NEAR(options.time_offset.at(39.9), 0.01 + 39.9 * 2e-4, 1e-12);
  EXPECT_NEAR(options.time_offset.at(40.0), 0.04 + 40.0 * 2e-4, 1e-12);
  EXPECT_NEAR(options.time_offset.at(60.0), -0.01 + 60.0 * 2e-4, 1e-12);
  expectExactEgoVelocity(builtIn("difficult"), options);
}

TEST(RadarModel, LeavesOutScansThatWouldHaveBeenMeasuredBeforeTheMotion) {
  SimulationOptions options = withoutErrors();
  options.time_offset.constant = 0.2;
  const SensorData data = simulate(builtIn("start_in_motion", 1, 30.0), options);
  ASSERT_FALSE(data.scans.empty());
  EXPECT_EQ(data.scans.front().seq, 0u);
  EXPECT_GE(data.scans.front().measured, options.start);
  EXPECT_NEAR(data.scans.front().stamp - options.start, 0.25, 1e-9);
}

TEST(RadarModel, FrameLengthAveragesTheDoppler) {
  const Motion motion = builtIn("difficult");
  SimulationOptions options = withoutErrors();
  const SensorData instant = simulate(motion, options);
  options.radar.frame_length = 0.2;
  const SensorData averaged = simulate(motion, options);
  double largest = 0.0;
  for (std::size_t k = 0; k < averaged.scans.size(); ++k) {
    const double t = averaged.scans[k].measured - options.start;
    if (t < 0.1 || t > motion.duration() - 0.1) continue;
    // The mean range rate is the change of range over the frame: needs no velocities at all. The points are
    // exact, so their place in W is known.
    const SimulatedPoint& point = averaged.scans[k].points.front();
    const auto radarAt = [&](double time) -> Eigen::Vector3d {
      const MotionState s = motion.at(time);
      return s.p_W + s.q_WI * options.T_IR.l_I;
    };
    const Eigen::Vector3d p_W = radarAt(t) + motion.at(t).q_WI * (options.T_IR.q_IR * point.position_R);
    const double mean = ((p_W - radarAt(t + 0.1)).norm() - (p_W - radarAt(t - 0.1)).norm()) / 0.2;
    ASSERT_NEAR(point.doppler, mean, 2e-4) << t;
    largest = std::max(largest, std::abs(point.doppler - instant.scans[k].points.front().doppler));
  }
  EXPECT_GT(largest, 0.02);  // the frame does matter in this motion
}

TEST(RadarModel, ShowsAsManyPointsAsAreAskedFor) {
  for (const int points : {20, 120, 1000}) {
    SimulationOptions options = withoutErrors();
    options.radar.points_mean = points;
    options.radar.points_sigma = 0.0;
    options.radar.points_max = points;
    double mean = 0.0;
    const SensorData data = simulate(builtIn("difficult"), options);
    for (const SimulatedScan& scan : data.scans)
      mean += static_cast<double>(scan.points.size()) / static_cast<double>(data.scans.size());
    EXPECT_NEAR(mean, points, 0.02 * points);
    options.radar.points_max = points - 1;
    EXPECT_THROW(simulate(builtIn("difficult"), options), std::invalid_argument);
  }
}

TEST(RadarModel, QuantisesTheDoppler) {
  SimulationOptions options;
  options.radar.doppler_step = 0.125;
  std::size_t moving = 0;
  for (const SimulatedScan& scan : simulate(builtIn("medium"), options).scans) {
    for (const SimulatedPoint& point : scan.points) {
      ASSERT_EQ(point.doppler, 0.125 * std::round(point.doppler / 0.125));
      moving += point.doppler != 0.0 ? 1 : 0;
    }
  }
  EXPECT_GT(moving, 1000u);
}

TEST(RadarModel, WrapsTheDopplerIntoItsSpan) {
  const Motion motion = builtIn("ground_vehicle", 1, 40.0);  // up to 5 m/s
  for (const double step : {0.0, 0.125}) {
    for (const double span : {3.0, 2.875}) {  // an even and an odd number of steps
      SimulationOptions options;
      options.radar.doppler_step = step;
      const SensorData unlimited = simulate(motion, options);
      options.radar.doppler_span = span;
      const SensorData limited = simulate(motion, options);
      ASSERT_EQ(limited.scans.size(), unlimited.scans.size());
      std::size_t wrapped = 0, first_bin = 0;
      for (std::size_t k = 0; k < limited.scans.size(); ++k) {
        // Only the Doppler differs, so that each point is its own truth.
        ASSERT_EQ(limited.scans[k].points.size(), unlimited.scans[k].points.size());
        for (std::size_t i = 0; i < limited.scans[k].points.size(); ++i) {
          const double seen = limited.scans[k].points[i].doppler;
          const double whole = unlimited.scans[k].points[i].doppler;
          ASSERT_GE(seen, -0.5 * span);
          ASSERT_LT(seen, 0.5 * span);
          ASSERT_NEAR((whole - seen) / span, std::round((whole - seen) / span), 1e-9) << whole;
          if (step > 0.0) {
            ASSERT_EQ(seen, step * std::round(seen / step));
          }
          wrapped += seen != whole ? 1 : 0;
          first_bin += step > 0.0 && seen < -0.5 * span + step ? 1 : 0;
        }
      }
      EXPECT_GT(wrapped, 1000u);
      // Both ends of the span meet there.
      if (step > 0.0) {
        EXPECT_GT(first_bin, 20u);
      }
    }
  }
}

TEST(RadarModel, WithoutNoiseTheSpanIsAllThatIsMissing) {
  SimulationOptions options = withoutErrors();
  options.radar.doppler_span = 3.0;
  options.radar.removeErrors();
  std::size_t wrapped = 0;
  for (const SimulatedScan& scan : simulate(builtIn("ground_vehicle", 1, 40.0), options).scans) {
    for (const SimulatedPoint& point : scan.points) {
      const double truth = -point.position_R.normalized().dot(scan.v_R);
      const double spans = (truth - point.doppler) / 3.0;
      ASSERT_NEAR(spans, std::round(spans), 1e-9);
      wrapped += std::abs(spans) > 0.5 ? 1 : 0;
    }
  }
  EXPECT_GT(wrapped, 1000u);
}

TEST(RadarModel, RefusesASpanThatIsNoWholeNumberOfSteps) {
  const Motion motion = builtIn("easy", 1, 30.0);
  SimulationOptions options;
  options.radar.doppler_step = 0.49;
  for (const double span : {3.0, 0.1, -2.94}) {
    options.radar.doppler_span = span;
    try {
      simulate(motion, options);
      FAIL() << "no exception for " << span;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find("doppler-span"), std::string::npos) << error.what();
    }
  }
  options.radar.doppler_span = 2.94;  // 6 steps, but not quite in floating point
  EXPECT_NO_THROW(simulate(motion, options));
}

TEST(RadarModel, AFlatRadarReportsAllInItsPlane) {
  SimulationOptions options;
  options.radar.ghost_share = 0.2;
  options.radar.fov_elevation = 5.0;
  options.radar.measures_elevation = false;
  const Motion motion = builtIn("ground_vehicle", 1, 40.0);
  std::size_t count = 0;
  for (const SimulatedScan& scan : simulate(motion, options).scans) {
    for (const SimulatedPoint& point : scan.points) {
      ASSERT_EQ(point.position_R.z(), 0.0);
      ASSERT_GE(point.position_R.y(), 0.0);
      ++count;
    }
  }
  EXPECT_GT(count, 5000u);

  // The same reflectors with and without elevation: range and angle to the row of antennas are those of the
  // things seen, which are not in the plane themselves.
  options.radar.removeErrors();
  const SensorData flat = simulate(motion, options);
  options.radar.measures_elevation = true;
  const SensorData truth = simulate(motion, options);
  double highest = 0.0;
  for (std::size_t k = 0; k < flat.scans.size(); ++k) {
    ASSERT_EQ(flat.scans[k].points.size(), truth.scans[k].points.size());
    for (std::size_t i = 0; i < flat.scans[k].points.size(); ++i) {
      const SimulatedPoint& seen = flat.scans[k].points[i];
      const Eigen::Vector3d& p_R = truth.scans[k].points[i].position_R;
      ASSERT_EQ(seen.position_R.z(), 0.0);
      ASSERT_NEAR(seen.position_R.norm(), p_R.norm(), 1e-9);
      ASSERT_NEAR(seen.position_R.x(), p_R.x(), 1e-9);
      ASSERT_EQ(seen.doppler, truth.scans[k].points[i].doppler);
      highest = std::max(highest, std::abs(std::asin(p_R.z() / p_R.norm())));
    }
  }
  EXPECT_NEAR(highest, 5.0 * 3.141592653589793 / 180.0, 0.005);
}

// Points of the scans that were delivered, fewest first.
std::vector<int> sortedCounts(const std::vector<SimulatedScan>& scans) {
  std::vector<int> counts;
  for (const SimulatedScan& scan : scans) {
    if (scan.delivered) counts.push_back(static_cast<int>(scan.points.size()));
  }
  std::sort(counts.begin(), counts.end());
  return counts;
}

TEST(RadarModel, SparseScansMayBeEmptyAndThenNotPublished) {
  const Motion motion = builtIn("medium");
  SimulationOptions options;
  options.radar.moving_share = 0.0;
  options.radar.points_mean = 3.0;
  options.radar.points_sigma = 2.0;
  EXPECT_EQ(sortedCounts(simulate(motion, options).scans).front(), 1);  // the limit as it has always been

  options.radar.points_min = 0;
  const SensorData all = simulate(motion, options);
  const std::vector<int> counts = sortedCounts(all.scans);
  ASSERT_EQ(counts.size(), all.scans.size());
  double total = 0.0;
  for (const int few : {0, 1, 2, 3, 4}) {
    const auto share = static_cast<double>(std::count(counts.begin(), counts.end(), few)) /
                       static_cast<double>(counts.size());
    EXPECT_GT(share, 0.05) << few;
    total += share;
  }
  EXPECT_NEAR(total, 0.77, 0.06);  // a normal distribution below 4.5

  options.radar.publish_empty = false;
  const SensorData some = simulate(motion, options);
  ASSERT_EQ(some.scans.size(), all.scans.size());
  for (std::size_t k = 0; k < all.scans.size(); ++k) {
    EXPECT_EQ(some.scans[k].delivered, !all.scans[k].points.empty());
    EXPECT_EQ(some.scans[k].seq, all.scans[k].seq);
    ASSERT_EQ(some.scans[k].points.size(), all.scans[k].points.size());
    if (!some.scans[k].points.empty()) {
      EXPECT_EQ(some.scans[k].points.front().doppler, all.scans[k].points.front().doppler);
    }
  }
  options.radar.points_min = options.radar.points_max + 1;
  EXPECT_THROW(simulate(motion, options), std::invalid_argument);
}

TEST(RadarModel, DopplerHasItsNoise) {
  // Same seed with and without errors of the points, so the same reflectors: compare point by point is not
  // possible (noise draws shift), so look at the Doppler residuals at rest instead, where truth is zero.
  SimulationOptions options;
  options.radar.doppler_step = 0.0;
  options.radar.ghost_share = 0.0;
  options.radar.moving_share = 0.0;
  options.radar.doppler_noise = 0.05;
  double square = 0.0;
  double count = 0.0;
  for (const SimulatedScan& scan : simulate(builtIn("easy"), options).scans) {
    if (scan.measured - options.start > 12.0) continue;
    for (const SimulatedPoint& point : scan.points) {
      square += point.doppler * point.doppler;
      count += 1.0;
    }
  }
  ASSERT_GT(count, 4000.0);
  EXPECT_NEAR(std::sqrt(square / count), 0.05, 5.0 * 0.05 / std::sqrt(2.0 * count));
}

TEST(RadarModel, AngularNoiseBendsDirectionsByItsSigma) {
  SimulationOptions options = withoutErrors();
  options.radar.azimuth_noise = 2.0;
  double square_azimuth = 0.0, square_elevation = 0.0;
  const SensorData exact = simulate(builtIn("difficult"), withoutErrors());
  const SensorData noisy = simulate(builtIn("difficult"), options);
  ASSERT_EQ(exact.scans.size(), noisy.scans.size());
  double count = 0.0;
  for (std::size_t k = 0; k < exact.scans.size(); ++k) {
    // All echoes of a scan are chosen before noise is drawn, and the draws are the same whatever their sigma.
    ASSERT_EQ(exact.scans[k].points.size(), noisy.scans[k].points.size());
    for (std::size_t i = 0; i < exact.scans[k].points.size(); ++i) {
      const Eigen::Vector3d& a = exact.scans[k].points[i].position_R;
      const Eigen::Vector3d& b = noisy.scans[k].points[i].position_R;
      square_azimuth += std::pow(std::atan2(b.x(), b.y()) - std::atan2(a.x(), a.y()), 2);
      square_elevation += std::pow(std::asin(b.z() / b.norm()) - std::asin(a.z() / a.norm()), 2);
      count += 1.0;
    }
  }
  ASSERT_GT(count, 30000.0);
  const double degree = 3.141592653589793 / 180.0;
  EXPECT_NEAR(std::sqrt(square_azimuth / count), 2.0 * degree, 0.02 * 2.0 * degree);
  EXPECT_LT(std::sqrt(square_elevation / count), 1e-9);
}

TEST(RadarModel, StaysInTheFieldOfViewAndRange) {
  SimulationOptions options = withoutErrors();
  options.radar.fov_azimuth = 40.0;
  options.radar.fov_elevation = 20.0;
  options.radar.min_range = 1.0;
  options.radar.max_range = 6.0;
  const double degree = 3.141592653589793 / 180.0;
  std::size_t count = 0;
  for (const SimulatedScan& scan : simulate(builtIn("easy"), options).scans) {
    for (const SimulatedPoint& point : scan.points) {
      const Eigen::Vector3d& p = point.position_R;
      ASSERT_GE(p.norm(), 1.0 - 1e-9);
      ASSERT_LE(p.norm(), 6.0 + 1e-9);
      ASSERT_LE(std::abs(std::atan2(p.x(), p.y())), 40.0 * degree + 1e-9);
      ASSERT_LE(std::abs(std::atan2(p.z(), std::hypot(p.x(), p.y()))), 20.0 * degree + 1e-9);
      ++count;
    }
  }
  EXPECT_GT(count, 5000u);
}

// Share of the points that do not fit the true velocity.
double shareOfMisfits(const std::string& motion, const SimulationOptions& options) {
  double misfits = 0.0, all = 0.0;
  for (const SimulatedScan& scan : simulate(builtIn(motion), options).scans) {
    for (const SimulatedPoint& point : scan.points) {
      misfits += std::abs(point.doppler + point.position_R.normalized().dot(scan.v_R)) > 1e-6 ? 1.0 : 0.0;
      all += 1.0;
    }
  }
  return misfits / all;
}

TEST(RadarModel, GhostsComeInTheirShare) {
  SimulationOptions options = withoutErrors();
  EXPECT_EQ(shareOfMisfits("gym_loop", options), 0.0);
  options.radar.ghost_share = 0.1;
  // 43000 points: sigma of the share is 0.0014.
  EXPECT_NEAR(shareOfMisfits("gym_loop", options), 0.1, 0.007);
}

TEST(RadarModel, APersonWalksThroughTheViewForItsShareOfTheTime) {
  SimulationOptions options = withoutErrors();
  options.radar.moving_share = 0.3;
  const Motion motion = builtIn("constant_speed", 1, 1000.0);
  std::size_t disturbed = 0;
  const SensorData data = simulate(motion, options);
  for (const SimulatedScan& scan : data.scans) {
    const bool moving = std::any_of(scan.points.begin(), scan.points.end(), [&](const SimulatedPoint& p) {
      return std::abs(p.doppler + p.position_R.normalized().dot(scan.v_R)) > 1e-6;
    });
    disturbed += moving ? 1 : 0;
  }
  // The person may leave the view before the visit ends, so somewhat less than the share is seen.
  const double share = static_cast<double>(disturbed) / static_cast<double>(data.scans.size());
  EXPECT_GT(share, 0.2);
  EXPECT_LT(share, 0.36);
}

// Persons in a scan without errors. Theirs are the first points, those of one after those of the other, and
// all of one share a horizontal velocity.
int personsIn(const SimulatedScan& scan, const Eigen::Quaterniond& q_WR) {
  int persons = 0;
  std::vector<Eigen::Vector2d> directions;  // of the person that is being read
  std::vector<double> speeds;               // away from the radar's place
  for (const SimulatedPoint& point : scan.points) {
    const Eigen::Vector3d direction_R = point.position_R.normalized();
    const double speed = point.doppler + direction_R.dot(scan.v_R);
    if (std::abs(speed) < 1e-6) break;  // the room begins
    directions.emplace_back((q_WR * direction_R).head<2>());
    speeds.push_back(speed);
    Eigen::MatrixXd H(static_cast<Eigen::Index>(speeds.size()), 2);
    for (Eigen::Index i = 0; i < H.rows(); ++i)
      H.row(i) = directions[static_cast<std::size_t>(i)].transpose();
    const Eigen::Map<const Eigen::VectorXd> y(speeds.data(), H.rows());
    const bool fits = (H * H.colPivHouseholderQr().solve(y) - y).norm() < 1e-6;
    if (fits && speeds.size() > 1) continue;
    ++persons;
    directions.erase(directions.begin(), directions.end() - 1);
    speeds.erase(speeds.begin(), speeds.end() - 1);
  }
  return persons;
}

TEST(RadarModel, ACrowdIsInViewAtOnceAndOnTheSameVisits) {
  SimulationOptions options = withoutErrors();
  options.radar.moving_share = 0.3;
  options.radar.points_mean = 150.0;
  options.radar.points_max = 200;
  const Motion motion = makeMotion({"constant_speed", 1, 200.0, MotionRestOptions{}, 0.2});
  const SensorData alone = simulate(motion, options);
  for (const int crowd : {1, 6}) {
    options.radar.crowd = crowd;
    const SensorData data = simulate(motion, options);
    ASSERT_EQ(data.scans.size(), alone.scans.size());
    int visits = 0, before = 0;
    double disturbed = 0.0;
    for (std::size_t k = 0; k < data.scans.size(); ++k) {
      const int persons = personsIn(data.scans[k], options.T_IR.q_IR);  // the IMU is level all the way
      const bool visited = personsIn(alone.scans[k], options.T_IR.q_IR) > 0;
      ASSERT_LE(persons, crowd) << k;
      // Nobody has left the view yet when a visit begins.
      if (before == 0 && visited) {
        EXPECT_EQ(persons, crowd) << k;
        ++visits;
      }
      disturbed += persons > 0 ? 1.0 : 0.0;
      before = persons;
    }
    EXPECT_GT(visits, 12);
    EXPECT_NEAR(disturbed / static_cast<double>(data.scans.size()), 0.3, crowd > 1 ? 0.06 : 0.1);
  }
}

TEST(RadarModel, ACrowdStaysWithinTheLimitOfPoints) {
  SimulationOptions options = withoutErrors();
  options.radar.moving_share = 0.5;
  options.radar.crowd = 20;
  std::size_t most = 0;
  for (const SimulatedScan& scan : simulate(builtIn("medium"), options).scans) {
    most = std::max(most, scan.points.size());
  }
  EXPECT_EQ(most, static_cast<std::size_t>(options.radar.points_max));
  options.radar.crowd = 0;
  EXPECT_THROW(simulate(builtIn("medium"), options), std::invalid_argument);
}

TEST(RadarModel, DropsScansInTheirShareAndLeavesTheOthersAlone) {
  SimulationOptions options;
  const Motion motion = builtIn("medium");
  const SensorData whole = simulate(motion, options);
  options.radar.dropout_share = 0.2;
  const SensorData holes = simulate(motion, options);
  ASSERT_EQ(whole.scans.size(), holes.scans.size());
  double lost = 0.0;
  for (std::size_t k = 0; k < whole.scans.size(); ++k) {
    EXPECT_EQ(holes.scans[k].seq, whole.scans[k].seq);
    if (!holes.scans[k].delivered) {
      lost += 1.0;
      EXPECT_TRUE(holes.scans[k].points.empty());
      continue;
    }
    ASSERT_EQ(whole.scans[k].points.size(), holes.scans[k].points.size());
    EXPECT_EQ(whole.scans[k].points.back().doppler, holes.scans[k].points.back().doppler);
  }
  // Sigma of the share over 900 scans is 0.013.
  EXPECT_NEAR(lost / static_cast<double>(whole.scans.size()), 0.2, 0.067);
}

TEST(RadarModel, BlackoutsAreSilentAndOnlyThey) {
  SimulationOptions options;
  options.radar.blackouts = {{20.0, 3.0}, {50.0, 0.5}};
  for (const SimulatedScan& scan : simulate(builtIn("medium"), options).scans) {
    const double t = scan.stamp - options.start;
    const bool silent = (t >= 20.0 && t < 23.0) || (t >= 50.0 && t < 50.5);
    EXPECT_EQ(scan.delivered, !silent) << t;
  }
}

TEST(RadarModel, ScansArriveWithTheLatency) {
  SimulationOptions options;
  options.radar.latency = 0.1;
  for (const SimulatedScan& scan : simulate(builtIn("easy", 1, 30.0), options).scans) {
    EXPECT_NEAR(scan.arrival - scan.stamp, 0.1, 1e-9);
  }
  options.radar.latency_sigma = 0.01;
  double square = 0.0, count = 0.0;
  for (const SimulatedScan& scan : simulate(builtIn("easy"), options).scans) {
    square += std::pow(scan.arrival - scan.stamp - 0.1, 2);
    count += 1.0;
  }
  EXPECT_NEAR(std::sqrt(square / count), 0.01, 5.0 * 0.01 / std::sqrt(2.0 * count));
}

TEST(RadarModel, RefusesOptionsOutOfRange) {
  const Motion motion = builtIn("easy", 1, 30.0);
  SimulationOptions options;
  options.radar.ghost_share = 1.5;
  EXPECT_THROW(simulate(motion, options), std::invalid_argument);
  options = SimulationOptions{};
  options.radar.rate = 0.0;
  EXPECT_THROW(simulate(motion, options), std::invalid_argument);
  options = SimulationOptions{};
  options.imu.rate = -1.0;
  EXPECT_THROW(simulate(motion, options), std::invalid_argument);
}

// --- Presets
// ---------------------------------------------------------------------------------------------------

double spread(const std::vector<double>& values) {
  double mean = 0.0, square = 0.0;
  for (const double v : values) mean += v / static_cast<double>(values.size());
  for (const double v : values) square += (v - mean) * (v - mean) / static_cast<double>(values.size());
  return std::sqrt(square);
}

TEST(Presets, AKartHasASparseCoarseRadarAndAnImuThatShakes) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    Preset kart = presetOf("kart");
    kart.options.seed = seed;
    const Motion motion = makeMotion({kart.motion, seed, kart.duration, kart.rest});
    const SensorData data = simulate(motion, kart.options);

    double length = 0.0;
    for (double t = 0.0; t < motion.duration(); t += 0.01) {
      const MotionState state = motion.at(t);
      length += 0.01 * state.v_W.norm();
      ASSERT_LT(std::abs(state.p_W.z()), 1e-6) << t;
      if (t < 2.0) {
        ASSERT_EQ(state.v_W.norm(), 0.0) << t;
      }
    }
    EXPECT_GT(motion.at(3.5).v_W.norm(), 0.5);
    EXPECT_NEAR(length, 120.0, 10.0);

    const std::vector<int> counts = sortedCounts(data.scans);
    EXPECT_EQ(counts[counts.size() / 10], 3);
    EXPECT_EQ(counts[counts.size() / 2], 6);
    EXPECT_EQ(counts[counts.size() * 9 / 10], 10);
    EXPECT_EQ(counts.front(), 1);                 // empty ones are not published
    EXPECT_LT(counts.size(), data.scans.size());  // and there are some
    EXPECT_NEAR(static_cast<double>(data.scans.size()) / motion.duration(), 30.0, 0.1);

    std::vector<double> ranges, azimuths, elevations;
    double misfits = 0.0;
    for (const SimulatedScan& scan : data.scans) {
      for (const SimulatedPoint& point : scan.points) {
        const Eigen::Vector3d& p_R = point.position_R;
        ASSERT_EQ(point.doppler, 0.49 * std::round(point.doppler / 0.49));
        ranges.push_back(p_R.norm());
        azimuths.push_back(std::atan2(p_R.x(), p_R.y()) * 180.0 / 3.141592653589793);
        elevations.push_back(std::asin(p_R.z() / p_R.norm()) * 180.0 / 3.141592653589793);
        // Two steps are far beyond half a step and what the angles' noise makes of 3 m/s.
        misfits += std::abs(point.doppler + p_R.normalized().dot(scan.v_R)) > 0.98 ? 1.0 : 0.0;
      }
    }
    std::nth_element(ranges.begin(), ranges.begin() + static_cast<std::ptrdiff_t>(ranges.size() / 2),
                     ranges.end());
    EXPECT_NEAR(ranges[ranges.size() / 2], 2.9, 0.15);
    EXPECT_NEAR(spread(azimuths), 31.0, 1.5);
    EXPECT_NEAR(spread(elevations), 35.0, 1.5);
    EXPECT_GT(misfits / static_cast<double>(ranges.size()), 0.01);
    EXPECT_LT(misfits / static_cast<double>(ranges.size()), 0.05);

    // Looks to the left and upwards, its right side level.
    const Eigen::Vector3d forward_I = kart.options.T_IR.q_IR * Eigen::Vector3d::UnitY();
    EXPECT_NEAR(std::atan2(forward_I.y(), forward_I.x()), 0.5236, 1e-4);
    EXPECT_NEAR(std::asin(forward_I.z()), 0.3840, 1e-4);
    EXPECT_NEAR((kart.options.T_IR.q_IR * Eigen::Vector3d::UnitX()).z(), 0.0, 1e-9);

    std::vector<double> at_rest;
    for (std::size_t i = 0; i < 200; ++i) at_rest.push_back(data.imu.samples[i].acceleration.x());
    EXPECT_NEAR(spread(at_rest), 0.8, 5.0 * 0.8 / std::sqrt(2.0 * 200.0));
    EXPECT_EQ(data.imu.samples[100].time - kart.options.start, 1.0);
  }
}

TEST(Presets, AreKnownByName) {
  for (const Preset& preset : presets()) EXPECT_EQ(presetOf(preset.name).motion, preset.motion);
  try {
    presetOf("tank");
    FAIL() << "no exception";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("kart"), std::string::npos) << error.what();
  }
}

// --- Together
// --------------------------------------------------------------------------------------------------

TEST(Simulation, SameSeedSameDataOtherSeedOtherData) {
  const Motion motion = builtIn("medium", 1, 30.0);
  SimulationOptions options;
  options.seed = 11;
  const SensorData a = simulate(motion, options);
  const SensorData b = simulate(motion, options);
  options.seed = 12;
  const SensorData c = simulate(motion, options);
  ASSERT_EQ(a.imu.samples.size(), b.imu.samples.size());
  bool imu_differs = false;
  for (std::size_t i = 0; i < a.imu.samples.size(); ++i) {
    ASSERT_EQ(a.imu.samples[i].acceleration, b.imu.samples[i].acceleration);
    ASSERT_EQ(a.imu.samples[i].angular_velocity, b.imu.samples[i].angular_velocity);
    imu_differs = imu_differs || a.imu.samples[i].acceleration != c.imu.samples[i].acceleration;
  }
  EXPECT_TRUE(imu_differs);
  bool radar_differs = false;
  for (std::size_t k = 0; k < a.scans.size(); ++k) {
    ASSERT_EQ(a.scans[k].points.size(), b.scans[k].points.size());
    radar_differs = radar_differs || a.scans[k].points.size() != c.scans[k].points.size();
    for (std::size_t i = 0; i < a.scans[k].points.size(); ++i) {
      ASSERT_EQ(a.scans[k].points[i].position_R, b.scans[k].points[i].position_R);
      ASSERT_EQ(a.scans[k].points[i].doppler, b.scans[k].points[i].doppler);
    }
  }
  EXPECT_TRUE(radar_differs);
}

TEST(Simulation, TheOffsetLeavesTheImuAlone) {
  const Motion motion = builtIn("medium", 1, 30.0);
  SimulationOptions options;
  const SensorData without = simulate(motion, options);
  options.time_offset.constant = 0.1;
  const SensorData with = simulate(motion, options);
  EXPECT_EQ(without.imu.samples.back().acceleration, with.imu.samples.back().acceleration);
}

TEST(Simulation, GroundTruthIsTheMotion) {
  const Motion motion = builtIn("drone", 1, 30.0);
  const Time start = Time::fromNanoseconds(1'700'000'000'000'000'000);
  const Trajectory truth = groundTruth(motion, 400.0, start);
  ASSERT_EQ(truth.size(), 12001u);
  EXPECT_EQ(truth[8000].time - start, 20.0);
  EXPECT_EQ(truth[8000].p_W, motion.at(20.0).p_W);
  EXPECT_EQ(truth[8000].q_WI.coeffs(), motion.at(20.0).q_WI.coeffs());
}

}  // namespace
}  // namespace rio_t::simulation
