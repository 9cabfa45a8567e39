// Buffer, preintegration, static initialisation, rest.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "noise.h"
#include "rio_t/core/so3.h"
#include "rio_t/imu/buffer.h"
#include "rio_t/imu/error_step.h"
#include "rio_t/imu/input_check.h"
#include "rio_t/imu/noise_meter.h"
#include "rio_t/imu/preintegration.h"
#include "rio_t/imu/rest_detector.h"
#include "rio_t/imu/static_initializer.h"
#include "synthetic_motion.h"

namespace rio_t {
namespace {

TEST(ImuBuffer, InterpolatesBetweenSamplesAndHoldsTheEnds) {
  ImuBuffer buffer;
  buffer.add({Time::fromSeconds(1.0), {1, 0, 0}, {0, 0, 0}});
  buffer.add({Time::fromSeconds(2.0), {3, 0, 0}, {0, 4, 0}});
  EXPECT_DOUBLE_EQ(buffer.at(Time::fromSeconds(1.25)).angular_velocity.x(), 1.5);
  EXPECT_DOUBLE_EQ(buffer.at(Time::fromSeconds(1.25)).acceleration.y(), 1.0);
  EXPECT_DOUBLE_EQ(buffer.at(Time::fromSeconds(0.0)).angular_velocity.x(), 1.0);
  EXPECT_DOUBLE_EQ(buffer.at(Time::fromSeconds(9.0)).angular_velocity.x(), 3.0);
  EXPECT_EQ(buffer.at(Time::fromSeconds(1.25)).time, Time::fromSeconds(1.25));
}

TEST(ImuBuffer, RefusesASampleThatIsNotLater) {
  ImuBuffer buffer;
  buffer.add({Time::fromSeconds(1.0), {}, {}});
  EXPECT_THROW(buffer.add({Time::fromSeconds(1.0), {}, {}}), std::invalid_argument);
}

TEST(ImuBuffer, DroppingKeepsWhatInterpolationNeeds) {
  ImuBuffer buffer;
  for (int i = 0; i < 10; ++i) buffer.add({Time::fromSeconds(i), {static_cast<double>(i), 0, 0}, {}});
  buffer.dropBefore(Time::fromSeconds(4.5));
  EXPECT_EQ(buffer.oldest(), Time::fromSeconds(4.0));
  EXPECT_DOUBLE_EQ(buffer.at(Time::fromSeconds(4.5)).angular_velocity.x(), 4.5);
}

TEST(ImuBuffer, IntervalsCoverTheSpanBothWays) {
  const ImuBuffer buffer = SyntheticMotion().imu(0.0, 1.0, 100.0);
  const SyntheticMotion motion;
  double forward = 0.0, backward = 0.0;
  int steps = 0;
  buffer.forEachInterval(motion.time(0.1234), motion.time(0.5678),
                         [&](double dt, const auto&, const auto&, const auto&) {
                           EXPECT_GT(dt, 0.0);
                           forward += dt;
                           ++steps;
                         });
  buffer.forEachInterval(motion.time(0.5678), motion.time(0.1234),
                         [&](double dt, const auto&, const auto&, const auto&) {
                           EXPECT_LT(dt, 0.0);
                           backward += dt;
                         });
  EXPECT_NEAR(forward, 0.4444, 1e-9);
  EXPECT_NEAR(backward, -0.4444, 1e-9);
  EXPECT_EQ(steps, 45);
}

TEST(Preintegration, AgreesWithDenseIntegration) {
  // 400 Hz against 20 kHz of the same motion: what is left is the error of the midpoint rule.
  const SyntheticMotion motion;
  const Preintegration coarse = preintegrate(motion.imu(0.0, 1.0, 400.0), motion.time(0.1), motion.time(0.9),
                                             motion.b_g, motion.b_a, ImuNoise());
  const Preintegration dense = preintegrate(motion.imu(0.0, 1.0, 20000.0), motion.time(0.1), motion.time(0.9),
                                            motion.b_g, motion.b_a, ImuNoise());
  EXPECT_NEAR(coarse.delta.dt, 0.8, 1e-9);
  EXPECT_LT(so3::log(coarse.delta.dR.conjugate() * dense.delta.dR).norm(), 1e-5);
  EXPECT_LT((coarse.delta.dv - dense.delta.dv).norm(), 1e-4);
  EXPECT_LT((coarse.delta.dp - dense.delta.dp).norm(), 1e-4);
}

TEST(Preintegration, ForwardThenBackwardIsTheIdentity) {
  const SyntheticMotion motion;
  const ImuBuffer imu = motion.imu(0.0, 1.0, 400.0);
  ImuDelta delta;
  const auto step = [&](double dt, const Eigen::Vector3d& gyro, const Eigen::Vector3d& accel, const auto&) {
    delta.step(dt, gyro - motion.b_g, accel - motion.b_a);
  };
  imu.forEachInterval(motion.time(0.2), motion.time(0.7), step);
  imu.forEachInterval(motion.time(0.7), motion.time(0.2), step);
  EXPECT_NEAR(delta.dt, 0.0, 1e-12);
  EXPECT_LT(so3::log(delta.dR).norm(), 1e-12);
  EXPECT_LT(delta.dv.norm(), 1e-12);
  EXPECT_LT(delta.dp.norm(), 1e-12);
}

TEST(Preintegration, BiasJacobiansPredictReintegration) {
  const SyntheticMotion motion;
  const ImuBuffer imu = motion.imu(0.0, 1.0, 400.0);
  const auto at = [&](const Eigen::Vector3d& d_bg, const Eigen::Vector3d& d_ba) {
    return preintegrate(imu, motion.time(0.1), motion.time(0.9), motion.b_g + d_bg, motion.b_a + d_ba,
                        ImuNoise())
        .delta;
  };
  const ImuDelta delta = at(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  const double h = 1e-5;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d d = h * Eigen::Vector3d::Unit(i);
    const ImuDelta g_plus = at(d, Eigen::Vector3d::Zero()), g_minus = at(-d, Eigen::Vector3d::Zero());
    const ImuDelta a_plus = at(Eigen::Vector3d::Zero(), d), a_minus = at(Eigen::Vector3d::Zero(), -d);
    EXPECT_LT((so3::log(g_minus.dR.conjugate() * g_plus.dR) / (2 * h) - delta.dR_dbg.col(i)).norm(), 1e-7);
    EXPECT_LT(((g_plus.dv - g_minus.dv) / (2 * h) - delta.dv_dbg.col(i)).norm(), 1e-6);
    EXPECT_LT(((g_plus.dp - g_minus.dp) / (2 * h) - delta.dp_dbg.col(i)).norm(), 1e-6);
    EXPECT_LT(((a_plus.dv - a_minus.dv) / (2 * h) - delta.dv_dba.col(i)).norm(), 1e-7);
    EXPECT_LT(((a_plus.dp - a_minus.dp) / (2 * h) - delta.dp_dba.col(i)).norm(), 1e-7);
  }
}

/// The covariance takes several samples in one step.
TEST(Preintegration, CovarianceIsThatOfStepsFromSampleToSample) {
  const SyntheticMotion motion;
  const ImuBuffer imu = motion.imu(0.0, 0.5, 500.0);
  ImuNoise noise;
  noise.gyro_density = 2e-3;
  noise.accel_density = 2e-2;
  ImuDelta delta;
  Eigen::Matrix<double, 9, 9> expected = Eigen::Matrix<double, 9, 9>::Zero();
  imu.forEachInterval(motion.time(0.0), motion.time(0.5),
                      [&](double dt, const auto& gyro, const auto& accel, const auto& later) {
                        const Eigen::Vector3d omega = gyro - motion.b_g, a = accel - motion.b_a;
                        SampleSum one;
                        one.add(delta.dR, dt, omega, a, noise.gyroVariance(later), noise.accelVariance(later),
                                0.0);
                        delta.step(dt, omega, a);
                        propagateCovariance(one, expected);
                      });
  const Preintegration p =
      preintegrate(imu, motion.time(0.0), motion.time(0.5), motion.b_g, motion.b_a, noise);
  Eigen::Matrix<double, 9, 9> whitening = Eigen::Matrix<double, 9, 9>::Identity();
  expected.llt().matrixL().solveInPlace(whitening);
  const Eigen::Matrix<double, 9, 9> whitened = whitening * p.covariance * whitening.transpose();
  EXPECT_LT((whitened - Eigen::Matrix<double, 9, 9>::Identity()).cwiseAbs().maxCoeff(), 0.004) << whitened;
}

class PreintegrationOfARate : public testing::TestWithParam<double> {};

TEST_P(PreintegrationOfARate, CovarianceIsThatOfManyNoisyRuns) {
  const SyntheticMotion motion;
  ImuNoise noise;
  noise.gyro_density = 2e-3;
  noise.accel_density = 2e-2;
  const double rate = GetParam();
  const ImuBuffer clean = motion.imu(0.0, 0.5, rate);
  const Preintegration expected =
      preintegrate(clean, motion.time(0.0), motion.time(0.5), motion.b_g, motion.b_a, noise);
  Noise draw;
  Eigen::Matrix<double, 9, 9> sum = Eigen::Matrix<double, 9, 9>::Zero();
  const int runs = 2000;
  for (int run = 0; run < runs; ++run) {
    ImuBuffer noisy;
    clean.forEachSample(motion.time(-1.0), motion.time(1.0), [&](ImuMeasurement sample) {
      sample.angular_velocity += noise.gyro_density * std::sqrt(rate) * draw.vector();
      sample.acceleration += noise.accel_density * std::sqrt(rate) * draw.vector();
      noisy.add(sample);
    });
    const Preintegration p =
        preintegrate(noisy, motion.time(0.0), motion.time(0.5), motion.b_g, motion.b_a, noise);
    Eigen::Matrix<double, 9, 1> e;
    e << so3::log(expected.delta.dR.conjugate() * p.delta.dR), p.delta.dp - expected.delta.dp,
        p.delta.dv - expected.delta.dv;
    sum += e * e.transpose();
  }
  // Whitened, the sample covariance is the identity up to its own spread, 1/sqrt(runs) = 2 % an entry, and up
  // to the end samples, which the trapezoid counts half: 1 % at 50 samples.
  Eigen::Matrix<double, 9, 9> whitening = Eigen::Matrix<double, 9, 9>::Identity();
  expected.covariance.llt().matrixL().solveInPlace(whitening);
  const Eigen::Matrix<double, 9, 9> whitened = whitening * (sum / runs) * whitening.transpose();
  EXPECT_LT((whitened - Eigen::Matrix<double, 9, 9>::Identity()).cwiseAbs().maxCoeff(), 0.15) << whitened;
}

// [Hz] One sample a step of the covariance, and several.
INSTANTIATE_TEST_SUITE_P(Rates, PreintegrationOfARate, testing::Values(100.0, 500.0));

TEST(NoiseMeter, MeasuresTheDensityAtRestAndInMotion) {
  const SyntheticMotion motion;
  for (const double rate : {100.0, 400.0}) {
    for (const bool moving : {false, true}) {
      for (const double sigma : {0.05, 2.0}) {
        Noise noise;
        NoiseMeter meter;
        for (double t = 0.0; t < 5.0; t += 1.0 / rate) {
          Eigen::Vector3d value = sigma * noise.vector();
          if (moving) value += motion.imuSample(t).acceleration;
          meter.add(motion.time(t), value);
        }
        EXPECT_NEAR(std::sqrt(meter.squaredDensity() * rate) / sigma, 1.0, 0.25) << rate << " Hz, " << sigma;
      }
    }
  }
}

TEST(NoiseMeter, MeasuresThoughSamplesAreMissingOrComeInBursts) {
  const SyntheticMotion motion;
  constexpr double kSigma = 0.5;
  // Every third sample of an IMU at 100 Hz is missing; a bus hands over four samples at a time.
  std::vector<std::vector<double>> patterns = {
      {0.01, 0.02}, {0.01, 0.02, 0.01, 0.02, 0.02}, {0.002, 0.002, 0.002, 0.024}};
  // A gap each second.
  patterns.emplace_back(100, 0.01);
  patterns.back().back() = 0.3;
  for (const std::vector<double>& spacings : patterns) {
    Noise noise;
    NoiseMeter meter;
    double t = 0.0;
    std::size_t samples = 0;
    for (; t < 10.0; t += spacings[samples++ % spacings.size()])
      meter.add(motion.time(t), motion.imuSample(t).acceleration + kSigma * noise.vector());
    const double rate = static_cast<double>(samples) / t;
    EXPECT_NEAR(std::sqrt(meter.squaredDensity() * rate) / kSigma, 1.0, 0.25) << spacings.back();
  }
}

TEST(NoiseMeter, ASignalThatStoodStillToTheLastBitMayBegin) {
  for (const double still : {9.81, 9.8125}) {
    Noise noise;
    NoiseMeter meter;
    for (int i = 0; i < 800; ++i) {
      const double sigma = i < 400 ? 0.0 : 0.4;
      meter.add(Time::fromSeconds(10.0 + 0.0025 * i),
                Eigen::Vector3d(0.0, 0.0, still) + sigma * noise.vector());
    }
    EXPECT_NEAR(std::sqrt(meter.squaredDensity()), 0.4 * std::sqrt(0.0025), 0.01);
  }
}

/// White noise has one density. A line of vibration averages out, and motion does not count.
TEST(NoiseSpectrum, MeansHaveLessOfAVibrationAndAllOfWhiteNoise) {
  for (const double rate : {100.0, 400.0}) {
    const auto densities = [&](double white, double line, double frequency) {
      NoiseSpectrum spectrum;
      Noise noise;
      for (int i = 0; i < static_cast<int>(10.0 * rate); ++i) {
        const double t = i / rate;
        spectrum.add(
            Time::fromSeconds(t),
            white * noise.vector() + Eigen::Vector3d(2.0 * std::sin(2.0 * M_PI * t),
                                                     line * std::sin(2.0 * M_PI * frequency * t), 0.0));
      }
      return std::pair(std::sqrt(spectrum.squaredDensity()), std::sqrt(spectrum.squaredDensityOfMeans()));
    };
    const auto [samples, means] = densities(0.5, 0.0, 0.0);
    EXPECT_NEAR(samples * std::sqrt(rate), 0.5, 0.1) << rate;
    EXPECT_GT(means, 0.6 * samples) << rate;
    const auto [shaken, averaged] = densities(0.0, 3.0, 0.35 * rate);
    EXPECT_GT(shaken * std::sqrt(rate), 2.0) << rate;
    EXPECT_LT(averaged, 0.3 * shaken) << rate;
  }
}

TEST(NoiseMeter, IsNotMovedByAKnockOrAGap) {
  const double rate = 200.0;
  Noise noise;
  NoiseMeter meter;
  Time time = Time::fromSeconds(10.0);
  const auto feed = [&](int samples, double sigma) {
    for (int i = 0; i < samples; ++i) meter.add(time = time + 1.0 / rate, sigma * noise.vector());
  };
  EXPECT_EQ(meter.squaredDensity(), 0.0);
  feed(1000, 0.1);
  meter.add(time = time + 1.0 / rate, Eigen::Vector3d(40.0, 0.0, 0.0));
  feed(20, 0.1);
  EXPECT_LT(std::sqrt(meter.squaredDensity() * rate), 0.135);
  time = time + 0.5;
  feed(600, 0.1);
  EXPECT_LT(std::sqrt(meter.squaredDensity() * rate), 0.13);
  // A motor that starts is seen within half a second.
  feed(100, 1.0);
  EXPECT_GT(std::sqrt(meter.squaredDensity() * rate), 0.4);
}

TEST(Levelling, AnyMountingPutsGravityDown) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      const Eigen::Vector3d f_I = sign * 9.81 * Eigen::Vector3d::Unit(axis);
      EXPECT_LT((levelingRotation(f_I) * f_I - Eigen::Vector3d(0, 0, 9.81)).norm(), 1e-9)
          << axis << " " << sign;
    }
  }
}

StaticInitializerOptions twoSeconds() {
  StaticInitializerOptions options;
  options.duration = 2.0;
  return options;
}

/// Feeds `seconds` of rest with noise; the result, if it came.
std::optional<StaticInitialization> feed(StaticInitializer& initializer, double from, double seconds,
                                         const Eigen::Vector3d& gyro, const Eigen::Vector3d& accel,
                                         double extra = 0.0) {
  Noise draw;
  for (int i = 0; i < static_cast<int>(seconds * 200.0); ++i) {
    const double t = from + i / 200.0;
    auto result = initializer.add(
        {Time::fromSeconds(t), gyro + (0.002 + extra) * draw.vector(), accel + 0.02 * draw.vector()});
    if (result) return result;
  }
  return std::nullopt;
}

TEST(StaticInitializer, SixMountingsWithBias) {
  const Eigen::Vector3d b_g(0.01, -0.02, 0.005);
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      StaticInitializer initializer(twoSeconds(), 9.81);
      const Eigen::Vector3d up_I = sign * Eigen::Vector3d::Unit(axis);
      const auto result = feed(initializer, 100.0, 3.0, b_g, 9.91 * up_I);
      ASSERT_TRUE(result) << initializer.waitingFor().text;
      EXPECT_LT((result->q_WI * up_I - Eigen::Vector3d::UnitZ()).norm(), 1e-3);
      EXPECT_LT((result->b_g - b_g).norm(), 5e-4);
      EXPECT_LT((result->b_a - 0.1 * up_I).norm(), 5e-3);
      EXPECT_NEAR(result->duration, 2.0, 0.01);
    }
  }
}

TEST(StaticInitializer, AGapIsNoRest) {
  StaticInitializer initializer(twoSeconds(), 9.81);
  const Eigen::Vector3d up(0.0, 0.0, 9.81);
  EXPECT_FALSE(feed(initializer, 100.0, 1.0, Eigen::Vector3d::Zero(), up));
  EXPECT_FALSE(feed(initializer, 103.0, 1.9, Eigen::Vector3d::Zero(), up));
  EXPECT_TRUE(feed(initializer, 104.9, 0.2, Eigen::Vector3d::Zero(), up));
}

/// Noise, or the line of an engine at this frequency [Hz].
TEST(StaticInitializer, AnIdlingEngineIsRest) {
  for (const double frequency : {0.0, 12.0, 17.0, 33.0, 70.0}) {
    ImuInputCheck check(0.1, ImuInputCheckOptions());
    StaticInitializer initializer(StaticInitializerOptions(), 9.81);
    Noise noise;
    std::optional<StaticInitialization> found;
    for (int i = 0; i < 800 && !found; ++i) {
      const double t = 0.005 * i;
      const Eigen::Vector3d shaking =
          frequency > 0.0 ? std::sin(2.0 * M_PI * frequency * t) * Eigen::Vector3d(2.0, 1.0, 2.0)
                          : Eigen::Vector3d(1.5 * noise.vector());
      ImuMeasurement sample{Time::fromSeconds(10.0 + t), Eigen::Vector3d(0.01, 0.0, -0.02),
                            Eigen::Vector3d(0.0, 0.0, 9.81) + shaking};
      check.check(sample);
      found = initializer.add(sample);
    }
    ASSERT_TRUE(found) << frequency << " Hz: " << initializer.waitingFor().text;
    EXPECT_LT((found->b_g - Eigen::Vector3d(0.01, 0.0, -0.02)).norm(), 1e-9);
  }
}

/// Feeds 200 Hz with noise whose density is known; the result, if it came.
std::optional<StaticInitialization> feedMotion(StaticInitializer& initializer, double seconds, double noise,
                                               const std::function<double(double)>& forward) {
  Noise draw;
  for (int i = 0; i < static_cast<int>(seconds * 200.0); ++i) {
    const double t = i / 200.0;
    ImuMeasurement sample{Time::fromSeconds(100.0 + t),
                          Eigen::Vector3d(0.01, 0.0, -0.02) + 0.002 * draw.vector(),
                          Eigen::Vector3d(0.0, forward(t), 9.81) + noise * draw.vector()};
    sample.gyro_mean_noise = 0.002 * 0.002 * 0.005;
    sample.accel_mean_noise = noise * noise * 0.005;
    if (auto result = initializer.add(sample)) return result;
  }
  return std::nullopt;
}

TEST(StaticInitializer, ASmoothStartEndsTheRestAndIsNotAveraged) {
  // At once, and within a second.
  for (const double ramp : {0.0, 1.0}) {
    for (const double noise : {0.02, 0.3}) {
      StaticInitializer initializer(StaticInitializerOptions(), 9.81);
      const auto found = feedMotion(initializer, 6.0, noise, [&](double t) {
        return t < 2.0 ? 0.0 : t < 2.0 + ramp ? 0.5 * (t - 2.0) / ramp : 0.5;
      });
      ASSERT_TRUE(found) << initializer.waitingFor().text;
      // What it averaged is 0.5 m/s^2 / g = 0.05 rad off where it had moved.
      const Eigen::Vector3d up_W = found->q_WI * Eigen::Vector3d::UnitZ();
      EXPECT_LT(std::acos(up_W.z()), 0.01) << "ramp " << ramp << ", noise " << noise;
      EXPECT_LT((found->b_g - Eigen::Vector3d(0.01, 0.0, -0.02)).norm(), 1e-3);
      EXPECT_LT(found->duration, 2.5) << "ramp " << ramp << ", noise " << noise;
      if (ramp == 0.0) {
        EXPECT_LE(found->time, Time::fromSeconds(102.0)) << "noise " << noise;
      }
    }
  }
}

TEST(StaticInitializer, LessThanASecondOfRestDoesNotCount) {
  StaticInitializer initializer(StaticInitializerOptions(), 9.81);
  const auto found =
      feedMotion(initializer, 2.5, 0.02, [](double t) { return t < 0.8 ? 0.0 : 2.0 * (t - 0.8); });
  EXPECT_FALSE(found);
  EXPECT_TRUE(initializer.hasSeenMotion());
}

TEST(StaticInitializer, AnEngineThatIdlesIsAveragedOverTheWholeDuration) {
  for (const double noise : {0.02, 0.3, 1.5}) {
    const StaticInitializerOptions options;
    StaticInitializer initializer(options, 9.81);
    const auto found = feedMotion(initializer, 6.0, noise, [](double) { return 0.0; });
    ASSERT_TRUE(found) << initializer.waitingFor().text;
    EXPECT_NEAR(found->duration, options.duration, 0.01) << noise;
    EXPECT_FALSE(initializer.hasSeenMotion());
  }
}

TEST(StaticInitializer, SaysWhatItWaitsForAndRecoversFromMotion) {
  StaticInitializer initializer(twoSeconds(), 9.81);
  EXPECT_FALSE(feed(initializer, 0.0, 4.0, Eigen::Vector3d::Zero(), {0, 0, 9.81}, 0.3));
  EXPECT_EQ(initializer.waitingFor().obstacle, StartObstacle::kMotion);
  EXPECT_NE(initializer.waitingFor().text.find("gyro moves"), std::string::npos);
  EXPECT_TRUE(feed(initializer, 4.0, 5.0, Eigen::Vector3d::Zero(), {0, 0, 9.81}));
}

TEST(StaticInitializer, NamesWrongUnits) {
  StaticInitializer in_g(twoSeconds(), 9.81);
  EXPECT_FALSE(feed(in_g, 0.0, 3.0, Eigen::Vector3d::Zero(), {0, 0, 1.0}));
  EXPECT_EQ(in_g.waitingFor().obstacle, StartObstacle::kWrongGravity);
  EXPECT_NE(in_g.waitingFor().text.find("not in m/s^2"), std::string::npos);
  // In motion, too; but 0.3 g may be an acceleration.
  StaticInitializer moving_in_g(twoSeconds(), 9.81), accelerating(twoSeconds(), 9.81);
  EXPECT_FALSE(feed(moving_in_g, 0.0, 3.0, Eigen::Vector3d::Zero(), {0, 0, 1.0}, 0.3));
  EXPECT_EQ(moving_in_g.waitingFor().obstacle, StartObstacle::kWrongGravity);
  EXPECT_FALSE(feed(accelerating, 0.0, 3.0, Eigen::Vector3d::Zero(), {0, 0, 1.3 * 9.81}, 0.3));
  EXPECT_EQ(accelerating.waitingFor().obstacle, StartObstacle::kMotion);
  StaticInitializer turning(twoSeconds(), 9.81);
  EXPECT_FALSE(feed(turning, 0.0, 3.0, {0, 0, 0.5}, {0, 0, 9.81}));
  EXPECT_EQ(turning.waitingFor().obstacle, StartObstacle::kMotion);
  EXPECT_NE(turning.waitingFor().text.find("not in rad/s"), std::string::npos);
}

ImuBuffer still(const Eigen::Vector3d& gyro, const Eigen::Vector3d& accel) {
  ImuBuffer buffer;
  Noise draw;
  for (int i = 0; i <= 200; ++i) {
    buffer.add({Time::fromSeconds(i / 200.0), gyro + 0.002 * draw.vector(), accel + 0.02 * draw.vector()});
  }
  return buffer;
}

TEST(Rest, IsSeenAndToldFromMotion) {
  RestContext context;
  context.g_W = {0, 0, -9.81};
  context.b_g = {0.01, 0, 0};
  const Time end = Time::fromSeconds(1.0);
  const auto rest = findRest(still({0.01, 0, 0}, {0, 0, 9.81}), end, context, RestOptions());
  ASSERT_TRUE(rest);
  EXPECT_FALSE(rest->shakes);
  EXPECT_FALSE(findRest(still({0.01, 0, 0.01}, {0, 0, 9.81}), end, context, RestOptions())) << "turning";
  EXPECT_FALSE(findRest(still({0.01, 0, 0}, {0.3, 0, 9.81}), end, context, RestOptions())) << "speeding up";
  RestContext riding = context;
  riding.v_W = {1.0, 0, 0};
  EXPECT_FALSE(findRest(still({0.01, 0, 0}, {0, 0, 9.81}), end, riding, RestOptions())) << "a smooth ride";
  RestOptions off;
  off.enabled = false;
  EXPECT_FALSE(findRest(still({0.01, 0, 0}, {0, 0, 9.81}), end, context, off));
}

TEST(Rest, ItsSigmaIsWhatThePlatformMayHaveGainedUnseen) {
  RestContext context;
  context.g_W = {0, 0, -9.81};
  const Time end = Time::fromSeconds(1.0);
  const RestOptions options;
  const auto quiet = findRest(still({0, 0, 0}, {0, 0, 9.81}), end, context, options);
  ASSERT_TRUE(quiet);
  EXPECT_LT(quiet->velocity_sigma, 1.1 * options.velocity_sigma);
  // It sets off so gently that it still passes for rest. After half a second it has 4 cm/s.
  const auto setting_off = findRest(still({0, 0, 0}, {0.08, 0, 9.81}), end, context, options);
  ASSERT_TRUE(setting_off);
  EXPECT_NEAR(setting_off->velocity_sigma, 0.08 * options.window, 0.005);
}

}  // namespace
}  // namespace rio_t
