// How much of the derivative with respect to the offset is motion: noise must not claim what no scan knows.
#include "rio_t/sensors/offset_evidence.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "noise.h"

namespace rio_t {
namespace {

const Eigen::Vector3d kGravity(0.0, 0.0, -9.81);  // in W

/// Feeds scans at 10 Hz whose derivative is a motion and noise [m/s^2]. The mean of two sides with
/// independent noise of sigma s has noise of s / sqrt(2).
struct Scans {
  Scans(double motion_in, double noise_in) : motion(motion_in), noise(noise_in) {}

  double motion;  ///< sigma per axis, the same on both sides
  double noise;   ///< sigma per axis and side
  /// The share of the mean's variance that is known: the noise of an IMU is measured where it is white.
  double known = 1.0;
  Eigen::Matrix3d weight = Eigen::Vector3d(400.0, 900.0, 100.0).asDiagonal();  // [s^2/m^2]
  Noise draw{11};
  double time = 1000.0;
  double claimed = 0.0;            ///< information about the offset, with the gain [1/s^2]
  double raw = 0.0;                ///< without it
  double known_information = 0.0;  ///< of the motion alone
  double gain_sum = 0.0;
  int count = 0;

  void feed(OffsetEvidence& evidence, double seconds) {
    claimed = raw = known_information = gain_sum = 0.0;
    count = 0;
    Eigen::Vector3d moving = Eigen::Vector3d::Zero();
    for (const double end = time + seconds; time < end; time += 0.1) {
      // A motion changes within a second.
      moving = 0.9 * moving + std::sqrt(1.0 - 0.81) * motion * draw.vector();
      OffsetDerivative d;
      d.before = moving + noise * draw.vector();
      d.after = moving + noise * draw.vector();
      d.mean = 0.5 * (d.before + d.after);
      d.variance = known * 0.5 * noise * noise;
      OffsetScan scan;
      scan.tau = Time::fromSeconds(time);
      scan.measured = weight.inverse();
      evidence.add(scan, d);
      const double gain = evidence.gain();
      EXPECT_GE(gain, 0.0);
      EXPECT_LE(gain, 1.0);
      claimed += gain * gain * d.mean.dot(weight * d.mean);
      raw += d.mean.dot(weight * d.mean);
      known_information += moving.dot(weight * moving);
      gain_sum += gain;
      ++count;
    }
  }
  double meanGain() const { return gain_sum / count; }
};

TEST(OffsetEvidence, NothingIsKnownAtFirst) { EXPECT_EQ(OffsetEvidence().gain(), 0.0); }

TEST(OffsetEvidence, NoiseAloneClaimsLittleEvenInAnHour) {
  // 0.35 m/s^2 in the mean: more than what remains of strong vibration.
  for (const double noise : {0.05, 0.5}) {
    OffsetEvidence evidence;
    Scans scans(0.0, noise);
    scans.feed(evidence, 3600.0);
    EXPECT_LT(scans.meanGain(), 0.02) << noise << " m/s^2";
    // The share of what the derivatives would claim as they are.
    EXPECT_LT(scans.claimed, 1e-3 * scans.raw) << noise << " m/s^2";
    EXPECT_GT(1.0 / std::sqrt(scans.claimed), 0.015) << noise << " m/s^2";
  }
}

TEST(OffsetEvidence, NoiseALittleBeyondWhatIsKnownIsNoMotion) {
  OffsetEvidence evidence;
  Scans scans(0.0, 0.5);
  scans.known = 0.5;
  scans.feed(evidence, 3600.0);
  EXPECT_LT(scans.meanGain(), 0.02);
}

TEST(OffsetEvidence, QuietMotionCountsWhole) {
  for (const double motion : {0.3, 1.0, 5.0}) {
    OffsetEvidence evidence;
    Scans scans(motion, 0.02);
    scans.feed(evidence, 60.0);
    scans.feed(evidence, 300.0);
    EXPECT_GT(scans.meanGain(), 0.9) << motion;
  }
}

TEST(OffsetEvidence, AMixCountsByItsShareAndClaimsNoMoreThanIsKnown) {
  // Both as likely as each other in the mean, and one more than the other.
  for (const double noise : {0.5, 1.0, 2.0}) {
    OffsetEvidence evidence;
    Scans scans(1.0, noise);
    scans.feed(evidence, 60.0);
    scans.feed(evidence, 3600.0);
    const double share = 1.0 / (1.0 + 0.5 * noise * noise);
    EXPECT_NEAR(scans.meanGain(), share, 0.2) << noise;
    EXPECT_LT(scans.meanGain(), share) << noise;
    EXPECT_LT(scans.claimed, scans.known_information) << noise;
  }
}

TEST(OffsetEvidence, WhatTiltAndBiasAddIsNoMotion) {
  // A wrong tilt looks like a steady acceleration, on both sides.
  OffsetEvidence evidence;
  const Eigen::Matrix3d weight = Scans(0.0, 0.0).weight;
  Noise draw{5};
  double gains = 0.0;
  Eigen::Vector3d error = Eigen::Vector3d::Zero();  // lasts for a second
  for (int i = 0; i < 2000; ++i) {
    OffsetDerivative d;
    if (i % 10 == 0) error = 0.1 * draw.vector();
    d.mean = d.before = d.after = error;
    d.variance = 1e-3;
    OffsetScan scan;
    scan.tau = Time::fromSeconds(0.1 * i);
    scan.shared = 0.01 * Eigen::Matrix3d::Identity();
    scan.measured = weight.inverse();
    evidence.add(scan, d);
    gains += evidence.gain() / 2000.0;
  }
  EXPECT_LT(gains, 0.1);
}

TEST(OffsetEvidence, IsForgottenWithinAMinute) {
  OffsetEvidence evidence;
  Scans scans(1.0, 0.1);
  scans.feed(evidence, 60.0);
  EXPECT_GT(evidence.gain(), 0.8);
  scans.motion = 0.0;
  scans.noise = 1.0;
  scans.feed(evidence, 120.0);
  EXPECT_LT(evidence.gain(), 0.1);
}

TEST(OffsetDerivative, SeesTheSameMotionOnBothSides) {
  // Speeding up by 2 m/s^2 along the y axis of I, which is level; 0.3 m/s^2 of it a bias.
  ImuBuffer imu;
  for (int i = 0; i <= 400; ++i)
    imu.add({Time::fromSeconds(0.005 * i), Eigen::Vector3d::Zero(), {0.0, 2.3, 9.81}});
  StateBlock x;
  x.b_a() = Eigen::Vector3d(0.0, 0.3, 0.0);
  const OffsetDerivative d =
      offsetDerivative(imu, Time::fromSeconds(1.0), x, kGravity, Extrinsics(), kOffsetHalfWidth);
  // A later stamp, and so a larger t_O, is an earlier velocity.
  const Eigen::Vector3d expected(0.0, -2.0, 0.0);
  EXPECT_LT((d.mean - expected).norm(), 1e-9);
  EXPECT_LT((d.before - expected).norm(), 1e-9);
  EXPECT_LT((d.after - expected).norm(), 1e-9);
}

TEST(OffsetDerivative, OfNoiseItsSidesAreIndependentAndItsVarianceIsKnown) {
  Noise draw;
  double product = 0.0, squares = 0.0, sides = 0.0;
  constexpr int kRuns = 2000;
  for (int run = 0; run < kRuns; ++run) {
    ImuBuffer imu;
    for (int i = 0; i <= 160; ++i) {
      ImuMeasurement sample{Time::fromSeconds(0.005 * i), Eigen::Vector3d::Zero(),
                            Eigen::Vector3d(0.0, 0.0, 9.81) + 0.5 * draw.vector()};
      sample.accel_noise = 0.5 * 0.5 * 0.005;
      imu.add(sample);
    }
    const OffsetDerivative d =
        offsetDerivative(imu, Time::fromSeconds(0.4), StateBlock(), kGravity, Extrinsics(), 0.2);
    product += d.before.dot(d.after) / kRuns;
    sides += 0.5 * (d.before.squaredNorm() + d.after.squaredNorm()) / kRuns;
    squares += d.mean.squaredNorm() / d.variance / (3 * kRuns);
  }
  EXPECT_LT(std::abs(product), 0.05 * sides);
  EXPECT_NEAR(squares, 1.0, 0.1);
}

TEST(OffsetDerivative, ItsSidesShareNoSampleThoughTheMeanIsWide) {
  // A wide mean reaches further than the samples: a scan waits for 0.11 s of them.
  for (const auto& [reach_before, reach_after] : {std::pair{1.0, 0.11}, {0.11, 1.0}}) {
    const Time scan = Time::fromSeconds(reach_before);
    ImuBuffer imu;
    for (int i = 0; i <= 111; ++i) {
      const Time time = Time::fromSeconds(0.01 * i);
      ImuMeasurement sample{
          time, Eigen::Vector3d::Zero(), {time < scan ? 1.0 : 0.0, time > scan ? 1.0 : 0.0, 9.81}};
      imu.add(sample);
    }
    const OffsetDerivative d =
        offsetDerivative(imu, scan, StateBlock(), kGravity, Extrinsics(), kMaxOffsetHalfWidth);
    EXPECT_NEAR(d.before.x(), -1.0, 0.1) << reach_before;
    EXPECT_NEAR(d.after.y(), -1.0, 0.1) << reach_before;
    EXPECT_NEAR(d.before.y(), 0.0, 1e-9) << reach_before;
    EXPECT_NEAR(d.after.x(), 0.0, 1e-9) << reach_before;
  }
}

/// A level IMU at 100 Hz with white noise of `sigma` per sample, that moves by `acceleration(t)` along x, for
/// a minute; its scans come at 50 Hz. The IMU reaches `ahead` samples past each scan.
template <class Acceleration>
void feedScans(const Acceleration& acceleration, double sigma, double predicted,
               const std::function<void(const OffsetScan&, const ImuBuffer&)>& use, int ahead = 11) {
  constexpr double kSpacing = 0.01;
  Noise draw;
  ImuBuffer imu;
  for (int i = 0; i < 6000; ++i) {
    const double t = kSpacing * i;
    ImuMeasurement sample{Time::fromSeconds(t), Eigen::Vector3d::Zero(),
                          Eigen::Vector3d(acceleration(t), 0.0, 9.81) + sigma * draw.vector()};
    sample.accel_noise = sigma * sigma * kSpacing;
    imu.add(sample);
    if (i < ahead || (i - ahead) % 2 != 0) continue;
    OffsetScan scan;
    scan.tau = Time::fromSeconds(kSpacing * (i - ahead));
    scan.predicted = predicted * Eigen::Matrix3d::Identity();
    scan.measured = 1e-4 * Eigen::Matrix3d::Identity();
    use(scan, imu);
  }
}

/// Evidence over the first width alone. `shared` is the variance of what tilt and bias may add [m^2/s^4].
template <class Acceleration>
OffsetEvidence evidenceOf(const Acceleration& acceleration, double sigma, double predicted, double shared) {
  OffsetEvidence evidence;
  feedScans(acceleration, sigma, predicted, [&](OffsetScan scan, const ImuBuffer& imu) {
    scan.shared = shared * Eigen::Matrix3d::Identity();
    evidence.add(scan, offsetDerivative(imu, scan.tau, StateBlock(), kGravity, Extrinsics(), 0.1));
  });
  return evidence;
}

TEST(OffsetEvidence, AConstantAccelerationTellsNothingOnceTheVelocityFollowsIt) {
  // A wrong offset then shifts every velocity by the same, and the estimate goes along. Only the changes of
  // the derivative tell the offset, and here they are noise, although the acceleration is far above it.
  const auto steady = [](double) { return 1.0; };
  const OffsetEvidence alone = evidenceOf(steady, 0.3, 0.0, 0.0);
  EXPECT_GT(alone.gain(), 0.9);
  const OffsetEvidence followed = evidenceOf(steady, 0.3, 1e-4, 0.0);
  EXPECT_LT(followed.gain(), 0.3);
  EXPECT_LT(followed.information(), 1e-3 * alone.information());
}

TEST(OffsetEvidence, TheVelocityFollowsAWrongTiltToo) {
  // A tilt that is wrong by 2 degrees adds 0.34 m/s^2 to every derivative, and nothing to its changes.
  const auto shaking = [](double t) { return std::sin(2.0 * M_PI * t); };
  EXPECT_GT(evidenceOf(shaking, 0.005, 1e-4, 0.34 * 0.34).gain(), 0.9);
}

/// The best width for an acceleration of 1 m/s^2 at `frequency` [Hz], and the gain there.
std::pair<double, double> bestWidth(double frequency, double sigma) {
  std::unique_ptr<OffsetWidths> widths;
  std::pair<double, double> best;
  feedScans([&](double t) { return std::sin(2.0 * M_PI * frequency * t); }, sigma, 1e-4,
            [&](const OffsetScan& scan, const ImuBuffer& imu) {
              if (!widths) widths = std::make_unique<OffsetWidths>(imu, kGravity);
              widths->add(scan);
              best = {widths->derivative(scan).half_width, widths->gain()};
            });
  return best;
}

TEST(OffsetWidths, FastMotionAndAQuietImuTakeTheNarrowestNoiseAWiderOne) {
  const auto [of_fast, gain_of_fast] = bestWidth(1.5, 0.005);
  EXPECT_EQ(of_fast, kOffsetHalfWidth);
  EXPECT_GT(gain_of_fast, 0.9);
  const auto [of_noise, gain_of_noise] = bestWidth(0.5, 0.5);
  EXPECT_GT(of_noise, kOffsetHalfWidth);
  EXPECT_GT(gain_of_noise, 0.1);
}

/// The gain after each scan of a noisy minute.
std::vector<double> gains(int ahead) {
  std::unique_ptr<OffsetWidths> widths;
  std::vector<double> result;
  feedScans([](double t) { return std::sin(M_PI * t); }, 0.5, 1e-4,
            [&](const OffsetScan& scan, const ImuBuffer& imu) {
              if (!widths) widths = std::make_unique<OffsetWidths>(imu, kGravity);
              widths->add(scan);
              result.push_back(widths->gain());
            },
            ahead);
  return result;
}

TEST(OffsetWidths, KnowTheSameHoweverFarTheImuIsAhead) {
  // The IMU reaches 0.11 s past each scan in one run, and 0.81 s in the other.
  const std::vector<double> of_near = gains(11);
  const std::vector<double> of_far = gains(81);
  ASSERT_LT(of_far.size(), of_near.size());
  for (std::size_t i = 0; i < of_far.size(); ++i) ASSERT_EQ(of_near[i], of_far[i]) << "scan " << i;
}

}  // namespace
}  // namespace rio_t
