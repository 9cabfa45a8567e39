#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "rio_t/core/so3.h"
#include "rio_t/simulation/imu_model.h"
#include "simulation_setup.h"

namespace rio_t::simulation {
namespace {

constexpr double kGravity = 9.81;

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

TEST(ImuModel, AWrongScaleOfTheGyroMultipliesTheRatesOfAnAxis) {
  const Motion motion = builtIn("difficult", 1, 40.0);
  ImuModelOptions options;
  options.removeErrors();
  const std::vector<ImuMeasurement> exact = simulateImu(motion, options, 1, Time()).samples;
  options.noise.gyro_scale_error = 0.01;
  const std::vector<ImuMeasurement> wrong = simulateImu(motion, options, 1, Time()).samples;
  const Eigen::Vector3d scale = wrong[8000].angular_velocity.cwiseQuotient(exact[8000].angular_velocity);
  EXPECT_GT((scale - Eigen::Vector3d::Ones()).norm(), 0.001);
  EXPECT_LT((scale - Eigen::Vector3d::Ones()).norm(), 0.06);
  for (std::size_t i = 0; i < exact.size(); ++i) {
    ASSERT_LT((wrong[i].angular_velocity - scale.cwiseProduct(exact[i].angular_velocity)).norm(), 1e-12) << i;
    ASSERT_EQ(wrong[i].acceleration, exact[i].acceleration) << i;
  }
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

TEST(ImuModel, RefusesNoiseThatIsNotANumber) {
  const Motion motion = builtIn("easy", 1, 30.0);
  ImuModelOptions options;
  options.noise.gyro_density = std::nan("");
  EXPECT_THROW(simulateImu(motion, options, 1, Time()), std::invalid_argument);
  options = ImuModelOptions{};
  options.accel_vibration = std::nan("");
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

TEST(ImuModel, LosesSamplesAndLeavesTheOthersAsTheyAre) {
  const Motion motion = builtIn("easy", 1, 30.0);
  ImuModelOptions options;
  const ImuData whole = simulateImu(motion, options, 1, Time());
  options.dropout_share = 0.3;
  const ImuData some = simulateImu(motion, options, 1, Time());
  EXPECT_NEAR(static_cast<double>(some.samples.size()) / static_cast<double>(whole.samples.size()), 0.7,
              0.02);
  EXPECT_EQ(some.b_a.size(), some.samples.size());
  EXPECT_EQ(some.b_g.size(), some.samples.size());
  EXPECT_EQ(some.samples.front().time, whole.samples.front().time);
  auto from = whole.samples.begin();
  for (const ImuMeasurement& sample : some.samples) {
    while (from != whole.samples.end() && from->time < sample.time) ++from;
    ASSERT_NE(from, whole.samples.end());
    ASSERT_EQ(sample.time, from->time);
    ASSERT_EQ(sample.acceleration, from->acceleration);
  }
  options.dropout_share = 1.0;
  EXPECT_THROW(simulateImu(motion, options, 1, Time()), std::invalid_argument);
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

}  // namespace
}  // namespace rio_t::simulation
