#include "rio_t/radar/ego_velocity.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <stdexcept>
#include <vector>

namespace rio_t {
namespace {

/// Random numbers that are the same with every standard library.
class Random {
 public:
  explicit Random(std::uint32_t seed) : engine_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_()) + 0.5) / 4294967296.0;
  }
  double normal() {  // Box-Muller
    return std::sqrt(-2.0 * std::log(uniform(0, 1))) * std::cos(2.0 * M_PI * uniform(0, 1));
  }

 private:
  std::mt19937 engine_;
};

Eigen::Vector3d direction(double azimuth, double elevation) {
  return {std::cos(elevation) * std::sin(azimuth), std::cos(elevation) * std::cos(azimuth),
          std::sin(elevation)};
}

struct Noise {
  double azimuth = 0.0, elevation = 0.0;     // [rad]
  double doppler = 0.0, quantization = 0.0;  // [m/s]
};

/// Static targets all over the field of view, seen at `v_R`.
RadarScan staticScene(const Eigen::Vector3d& v_R, int points, const Noise& noise, Random& random,
                      double elevation_spread = 0.35) {
  RadarScan scan;
  for (int i = 0; i < points; ++i) {
    const double azimuth = random.uniform(-0.9, 0.9);
    const double elevation = random.uniform(-elevation_spread, elevation_spread);
    RadarPoint p;
    p.doppler = -direction(azimuth, elevation).dot(v_R) + noise.doppler * random.normal();
    if (noise.quantization > 0) p.doppler = noise.quantization * std::round(p.doppler / noise.quantization);
    p.position_R = random.uniform(1.0, 9.0) * direction(azimuth + noise.azimuth * random.normal(),
                                                        elevation + noise.elevation * random.normal());
    p.snr_db = 15.0;
    scan.points.push_back(p);
  }
  return scan;
}

/// Estimation without anything that widens the covariance, for tests of the solver.
EgoVelocityOptions bareOptions(EgoVelocitySolver solver) {
  EgoVelocityOptions o;
  o.solver = solver;
  o.added_sigma.setZero();
  return o;
}

/// [m/s] Given as the step: the Doppler has none.
constexpr double kNoStep = 1e-6;

const Eigen::Vector3d kVelocity(0.4, 1.2, -0.3);

TEST(EgoVelocity, ExactWithoutNoise) {
  for (const EgoVelocitySolver solver :
       {EgoVelocitySolver::kLeastSquares, EgoVelocitySolver::kErrorsInVariables}) {
    EgoVelocityOptions o = bareOptions(solver);
    o.azimuth_sigma = o.elevation_sigma = o.doppler_sigma = 0.0;
    o.doppler_quantization = kNoStep;
    Random random(1);
    const EgoVelocity e = EgoVelocityEstimator(o).estimate(staticScene(kVelocity, 30, {}, random));
    EXPECT_EQ(e.status, EgoVelocityStatus::kMoving);
    EXPECT_LT((e.v_R - kVelocity).norm(), 1e-9) << toString(solver);
    EXPECT_EQ(e.inliers.size(), 30u);
    EXPECT_EQ(e.points.size(), 30u);
  }
}

TEST(EgoVelocity, SignAndAxes) {
  // Driving forward, a target ahead approaches: negative range rate, positive y velocity.
  RadarScan scan;
  for (const double azimuth : {-0.6, -0.3, 0.0, 0.3, 0.6}) {
    for (const double elevation : {-0.3, 0.0, 0.3}) {
      scan.points.push_back({4.0 * direction(azimuth, elevation), -direction(azimuth, elevation).y(), 20.0});
    }
  }
  const EgoVelocity e = EgoVelocityEstimator(EgoVelocityOptions()).estimate(scan);
  EXPECT_EQ(e.status, EgoVelocityStatus::kMoving);
  EXPECT_NEAR(e.v_R.y(), 1.0, 0.02);
  EXPECT_NEAR(e.v_R.x(), 0.0, 0.02);
  EXPECT_NEAR(e.v_R.z(), 0.0, 0.05);
}

TEST(EgoVelocity, FortyPercentOutliers) {
  Random random(2);
  const EgoVelocityEstimator estimator{EgoVelocityOptions()};
  for (int trial = 0; trial < 200; ++trial) {
    RadarScan scan = staticScene(kVelocity, 50, {0.01, 0.02, 0.01, 0.125}, random);
    for (std::size_t i = 0; i < scan.points.size(); i += 5) {  // two of five
      for (const std::size_t k : {i, i + 1}) {
        const double sign = random.uniform(-1, 1) < 0 ? -1 : 1;
        scan.points[k].doppler += sign * random.uniform(0.6, 3.0);
      }
    }
    const EgoVelocity e = estimator.estimate(scan);
    ASSERT_EQ(e.status, EgoVelocityStatus::kMoving) << trial;
    for (const std::size_t i : e.inliers) EXPECT_GE(i % 5, 2u) << "outlier taken, trial " << trial;
    EXPECT_GE(e.inliers.size(), 28u);
    EXPECT_LT((e.v_R - kVelocity).norm(), 0.15) << trial;
  }
}

TEST(EgoVelocity, SameScanSameAnswer) {
  Random random(3);
  const RadarScan scan = staticScene(kVelocity, 40, {0.03, 0.05, 0.03, 0.125}, random);
  const EgoVelocityEstimator estimator{EgoVelocityOptions()};
  const EgoVelocity first = estimator.estimate(scan);
  estimator.estimate(staticScene(-kVelocity, 25, {}, random));  // must leave no trace
  const EgoVelocity again = estimator.estimate(scan);
  EXPECT_EQ(first.v_R, again.v_R);
  EXPECT_EQ(first.covariance, again.covariance);
  EXPECT_EQ(first.inliers, again.inliers);
}

TEST(EgoVelocity, FilterLeavesOutWhatItShould) {
  Random random(4);
  RadarScan scan = staticScene(kVelocity, 20, {}, random);
  const std::size_t good = scan.points.size();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  scan.points.push_back({Eigen::Vector3d::Zero(), 0.0, 20.0});   // at the origin
  scan.points.push_back({direction(0, 0) * 0.1, 0.0, 20.0});     // too near
  scan.points.push_back({direction(0, 0) * 200.0, 0.0, 20.0});   // too far
  scan.points.push_back({direction(0, 0) * 3.0, 0.0, 1.0});      // too weak
  scan.points.push_back({direction(1.2, 0) * 3.0, 0.0, 20.0});   // to the side
  scan.points.push_back({direction(-1.2, 0) * 3.0, 0.0, 20.0});  // to the other
  scan.points.push_back({direction(3.1, 0) * 3.0, 0.0, 20.0});   // behind
  scan.points.push_back({direction(0, 1.2) * 3.0, 0.0, 20.0});   // above
  scan.points.push_back({direction(0, -1.2) * 3.0, 0.0, 20.0});  // below
  scan.points.push_back({direction(0, 0) * 3.0, nan, 20.0});     // not finite, in every member
  scan.points.push_back({direction(0, 0) * 3.0, 0.0, nan});
  scan.points.push_back({Eigen::Vector3d(nan, 1, 1), 0.0, 20.0});
  EgoVelocityOptions o;
  o.max_azimuth = 1.0;
  o.max_elevation = 1.0;
  const EgoVelocity e = EgoVelocityEstimator(o).estimate(scan);
  EXPECT_EQ(e.points.size(), good);
  for (const std::size_t i : e.inliers) EXPECT_LT(i, good);

  EgoVelocityOptions no_min_range = o;  // a point without direction must not pass even then
  no_min_range.min_range = 0.0;
  EXPECT_EQ(EgoVelocityEstimator(no_min_range).estimate(scan).points.size(), good + 1);
}

TEST(EgoVelocity, RestWithSomethingMoving) {
  Random random(5);
  RadarScan scan = staticScene(Eigen::Vector3d::Zero(), 40, {}, random);
  for (std::size_t i = 0; i < 9; ++i) scan.points[i].doppler = 0.7;  // under a quarter
  const EgoVelocity e = EgoVelocityEstimator(EgoVelocityOptions()).estimate(scan);
  EXPECT_EQ(e.status, EgoVelocityStatus::kZeroVelocity);
  EXPECT_EQ(e.v_R, Eigen::Vector3d::Zero());
  EXPECT_EQ(e.inliers.size(), 31u);
  for (const std::size_t i : e.inliers) EXPECT_GE(i, 9u);
}

TEST(EgoVelocity, RestWithALargeObjectMoving) {
  // More than a quarter moves, so the first test for rest fails; RANSAC then finds that the rest stands
  // still.
  Random random(6);
  RadarScan scan = staticScene(Eigen::Vector3d::Zero(), 40, {}, random);
  for (std::size_t i = 0; i < 15; ++i) scan.points[i].doppler = 0.7 + 0.1 * static_cast<double>(i % 5);
  const EgoVelocity e = EgoVelocityEstimator(EgoVelocityOptions()).estimate(scan);
  EXPECT_EQ(e.status, EgoVelocityStatus::kZeroVelocity);
  EXPECT_EQ(e.inliers.size(), 25u);
}

EgoVelocityOptions simulatedRadarOptions() {
  EgoVelocityOptions o;
  o.azimuth_sigma = 0.0436;
  o.elevation_sigma = 0.0785;
  o.doppler_sigma = 0.02;
  o.doppler_quantization = 0.125;
  return o;
}

// Less than a bin, most points read zero, and those along the motion do not.
TEST(EgoVelocity, ASlowRideIsNoRestAndHasItsVelocity) {
  for (const double speed : {0.08, 0.12}) {
    const EgoVelocityEstimator estimator(simulatedRadarOptions());
    Random random(16);
    int denied = 0;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    double squares = 0.0;
    constexpr int kTrials = 1000;
    for (int trial = 0; trial < kTrials; ++trial) {
      const Eigen::Vector3d v(0.0, speed, 0.0);
      const EgoVelocity e = estimator.estimate(staticScene(v, 70, {0.0436, 0.0785, 0.02, 0.125}, random));
      if (!e.denies_rest) continue;
      EXPECT_EQ(e.status, EgoVelocityStatus::kMoving);
      ++denied;
      mean += e.v_R;
      squares += (e.v_R - v).dot(e.covariance.llt().solve(e.v_R - v));
    }
    EXPECT_GT(denied, kTrials * 95 / 100) << speed;
    EXPECT_NEAR(mean.y() / denied, speed, 0.01) << speed;
    EXPECT_NEAR(mean.x() / denied, 0.0, 0.005) << speed;
    EXPECT_NEAR(mean.z() / denied, 0.0, 0.01) << speed;
    EXPECT_LT(squares / denied, 3.0) << speed;
  }
}

TEST(EgoVelocity, RestIsNotDeniedByPointsABinOff) {
  const EgoVelocityEstimator estimator(simulatedRadarOptions());
  Random random(17);
  int denied = 0;
  int rests = 0;
  constexpr int kTrials = 2000;
  for (int trial = 0; trial < kTrials; ++trial) {
    RadarScan scan = staticScene(Eigen::Vector3d::Zero(), 70, {0.0436, 0.0785, 0.02, 0.125}, random);
    for (RadarPoint& p : scan.points)
      if (random.uniform(0.0, 1.0) < 0.1) p.doppler += random.uniform(-1.0, 1.0) < 0.0 ? -0.125 : 0.125;
    const EgoVelocity e = estimator.estimate(scan);
    denied += e.denies_rest ? 1 : 0;
    rests += e.status == EgoVelocityStatus::kZeroVelocity ? 1 : 0;
  }
  EXPECT_LT(denied, kTrials / 100);
  EXPECT_GT(rests, kTrials * 99 / 100);
}

TEST(EgoVelocity, AroundAPredictionMostPointsHaveToAgree) {
  const EgoVelocityEstimator estimator(simulatedRadarOptions());
  VelocityPrior prior;
  prior.v_R = kVelocity;
  prior.covariance = 0.01 * 0.01 * Eigen::Matrix3d::Identity();
  Random random(18);
  // So few that `estimate` does not decide; `wrong` of them move.
  const auto around = [&](int points, std::size_t wrong) {
    RadarScan scan = staticScene(kVelocity, points, {}, random);
    for (std::size_t i = 0; i < wrong; ++i) scan.points[i].doppler += 1.5;
    return estimator.around(scan, prior);
  };
  for (const int points : {1, 2, 3, 10}) {
    const EgoVelocity e = around(points, 0);
    EXPECT_EQ(e.status, EgoVelocityStatus::kMoving) << points;
    EXPECT_EQ(e.inliers.size(), static_cast<std::size_t>(points));
    EXPECT_EQ(e.v_R, prior.v_R);
  }
  EXPECT_FALSE(isValid(around(1, 1).status));
  EXPECT_FALSE(isValid(around(2, 1).status));
  EXPECT_TRUE(isValid(around(3, 1).status));
  EXPECT_TRUE(isValid(around(10, 4).status));
  EXPECT_FALSE(isValid(around(10, 5).status));
  const EgoVelocity most = around(10, 4);
  EXPECT_EQ(most.inliers, (std::vector<std::size_t>{4, 5, 6, 7, 8, 9}));
  EXPECT_EQ(most.points.size(), 10u);
  EXPECT_FALSE(isValid(around(0, 0).status));
  // A vaguer prediction agrees with more.
  prior.covariance = Eigen::Matrix3d::Identity();
  EXPECT_TRUE(isValid(around(2, 2).status));
}

// A bin of width q hides every velocity below about q/2; the covariance at rest has to admit that.
TEST(EgoVelocity, CoarseDopplerDoesNotFakeRest) {
  EgoVelocityOptions o;
  o.doppler_quantization = 0.5;
  o.max_sigma = 1.0;
  const EgoVelocityEstimator estimator(o);
  Random random(7);
  double squares = 0.0;
  int rests = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const Eigen::Vector3d v(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3));
    const EgoVelocity e = estimator.estimate(staticScene(v, 40, {0, 0, 0, 0.5}, random));
    if (e.status != EgoVelocityStatus::kZeroVelocity) continue;
    ++rests;
    squares += v.dot(e.covariance.llt().solve(v));
  }
  EXPECT_GT(rests, 200);  // the case is there
  EXPECT_LT(squares / rests, 3.0);
  EXPECT_GT(squares / rests, 0.5);  // honest, not useless
}

TEST(EgoVelocity, ExactDopplerAtRestKeepsTheSigmaGiven) {
  EgoVelocityOptions o;
  o.doppler_quantization = kNoStep;
  o.doppler_sigma = 0.0;
  Random random(8);
  const EgoVelocity e =
      EgoVelocityEstimator(o).estimate(staticScene(Eigen::Vector3d::Zero(), 40, {}, random));
  EXPECT_EQ(e.status, EgoVelocityStatus::kZeroVelocity);
  const double variance = o.zero_velocity_sigma * o.zero_velocity_sigma;
  EXPECT_LT((e.covariance - variance * Eigen::Matrix3d::Identity()).norm(), 1e-12);
}

void observe(EgoVelocityEstimator& estimator, double step, Random& random) {
  for (int i = 0; i < 10; ++i) estimator.observe(staticScene(kVelocity, 40, {0, 0, 0.035, step}, random));
}

TEST(EgoVelocity, WhatFollowsFromTheStepFollowsIt) {
  Random random(13);
  EgoVelocityEstimator estimator{EgoVelocityOptions()};
  const auto expect = [&](double step, DopplerStepSource source, double inlier, double zero) {
    EXPECT_EQ(estimator.dopplerStep().source, source);
    EXPECT_NEAR(estimator.options().doppler_quantization, step, 1e-9);
    EXPECT_NEAR(estimator.noise().quantization, step * step / 12.0, 1e-9);
    EXPECT_NEAR(estimator.options().ransac_inlier_threshold, inlier, 1e-9);
    EXPECT_NEAR(estimator.options().zero_velocity_threshold, zero, 1e-9);
  };
  expect(0.125, DopplerStepSource::kUnknown, 0.15, 0.0625);  // of the radar that most users have
  observe(estimator, 0.5, random);
  expect(0.5, DopplerStepSource::kData, 0.25 + 2.5 * 0.035, 0.25);
  observe(estimator, 0.0, random);
  expect(0.0, DopplerStepSource::kData, 2.5 * 0.035, 1.5 * 0.035);
}

TEST(EgoVelocity, WhatIsGivenDoesNotFollowTheStep) {
  Random random(14);
  EgoVelocityOptions o;
  o.ransac_inlier_threshold = 0.3;
  o.zero_velocity_threshold = 0.07;
  EgoVelocityEstimator thresholds(o);
  observe(thresholds, 0.5, random);
  EXPECT_EQ(thresholds.options().ransac_inlier_threshold, 0.3);
  EXPECT_EQ(thresholds.options().zero_velocity_threshold, 0.07);
  EXPECT_EQ(thresholds.options().doppler_quantization, 0.5);

  o = EgoVelocityOptions();
  o.doppler_quantization = 0.25;
  EgoVelocityEstimator step(o);
  observe(step, 0.5, random);
  EXPECT_EQ(step.dopplerStep().source, DopplerStepSource::kGiven);
  EXPECT_EQ(step.options().doppler_quantization, 0.25);
  EXPECT_NEAR(step.options().ransac_inlier_threshold, 0.125 + 2.5 * 0.035, 1e-9);
}

TEST(EgoVelocity, ACoarseRadarIsUsedOnceItsStepIsKnown) {
  const Noise coarse{0.01, 0.02, 0.035, 0.5};
  EgoVelocityEstimator estimator{EgoVelocityOptions()};
  Random random(15);
  const auto inliers = [&] {
    double sum = 0.0;
    for (int i = 0; i < 200; ++i)
      sum +=
          static_cast<double>(estimator.estimate(staticScene(kVelocity, 40, coarse, random)).inliers.size());
    return sum / (200 * 40);
  };
  EXPECT_LT(inliers(), 0.75);  // the reason for all this
  observe(estimator, coarse.quantization, random);
  EXPECT_GT(inliers(), 0.95);
}

TEST(EgoVelocity, TooFewPoints) {
  const EgoVelocityEstimator estimator{EgoVelocityOptions()};
  EXPECT_EQ(estimator.estimate(RadarScan()).status, EgoVelocityStatus::kTooFewPoints);
  Random random(9);
  EXPECT_EQ(estimator.estimate(staticScene(kVelocity, 2, {}, random)).status,
            EgoVelocityStatus::kTooFewPoints);
}

TEST(EgoVelocity, TooFewInliers) {
  Random random(10);
  RadarScan scan = staticScene(kVelocity, 40, {}, random);
  for (RadarPoint& p : scan.points) p.doppler = random.uniform(-4.0, 4.0);
  const EgoVelocity e = EgoVelocityEstimator(EgoVelocityOptions()).estimate(scan);
  EXPECT_EQ(e.status, EgoVelocityStatus::kTooFewInliers);
  EXPECT_FALSE(isValid(e.status));
  EXPECT_EQ(e.v_R, Eigen::Vector3d::Zero());  // a velocity that must not be used is not given

  // Three points agree on any velocity; that is no evidence.
  EXPECT_EQ(EgoVelocityEstimator(EgoVelocityOptions()).estimate(staticScene(kVelocity, 3, {}, random)).status,
            EgoVelocityStatus::kTooFewInliers);
}

TEST(EgoVelocity, IllConditioned) {
  Random random(11);
  const EgoVelocityEstimator estimator{EgoVelocityOptions()};
  const RadarScan flat = staticScene(kVelocity, 40, {}, random, 0.0);  // all on the horizon: z is not seen
  EXPECT_EQ(estimator.estimate(flat).status, EgoVelocityStatus::kIllConditioned);
  // At rest as well: what is not seen is not known to be zero.
  const RadarScan flat_rest = staticScene(Eigen::Vector3d::Zero(), 40, {}, random, 0.0);
  EXPECT_EQ(estimator.estimate(flat_rest).status, EgoVelocityStatus::kIllConditioned);
}

TEST(EgoVelocity, SigmaTooLarge) {
  EgoVelocityOptions o;
  o.max_sigma = 0.03;
  Random random(12);
  const EgoVelocity e =
      EgoVelocityEstimator(o).estimate(staticScene(kVelocity, 12, {0.02, 0.04, 0.03, 0.125}, random));
  EXPECT_EQ(e.status, EgoVelocityStatus::kSigmaTooLarge);
}

TEST(EgoVelocity, StatusAndSolverNames) {
  std::set<std::string> names;
  for (const EgoVelocityStatus status :
       {EgoVelocityStatus::kMoving, EgoVelocityStatus::kZeroVelocity, EgoVelocityStatus::kTooFewPoints,
        EgoVelocityStatus::kTooFewInliers, EgoVelocityStatus::kIllConditioned,
        EgoVelocityStatus::kSigmaTooLarge, EgoVelocityStatus::kAmbiguous}) {
    names.insert(toString(status));
  }
  EXPECT_EQ(names.size(), 7u);
  for (const EgoVelocitySolver solver :
       {EgoVelocitySolver::kLeastSquares, EgoVelocitySolver::kErrorsInVariables}) {
    EXPECT_EQ(egoVelocitySolverFromString(toString(solver)), solver);
  }
  EXPECT_THROW(egoVelocitySolverFromString("odr"), std::invalid_argument);
}

TEST(EgoVelocity, RefusesSenselessOptions) {
  const auto refused = [](void (*spoil)(EgoVelocityOptions&)) {
    EgoVelocityOptions o;
    spoil(o);
    EXPECT_THROW(EgoVelocityEstimator{o}, std::invalid_argument);
  };
  refused([](EgoVelocityOptions& o) { o.max_range = 0.1; });
  refused([](EgoVelocityOptions& o) { o.ransac_success_probability = 1.0; });
  refused([](EgoVelocityOptions& o) { o.ransac_outlier_probability = 1.0; });
  refused(
      [](EgoVelocityOptions& o) { o.ransac_inlier_threshold = std::numeric_limits<double>::quiet_NaN(); });
  refused([](EgoVelocityOptions& o) { o.doppler_quantization = -0.1; });
  refused([](EgoVelocityOptions& o) { o.added_sigma.z() = -1.0; });
}

// --- Bias and honesty
// -----------------------------------------------------------------------------------------------

struct MonteCarlo {
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d rms = Eigen::Vector3d::Zero();
  double nees = 0.0;
};

MonteCarlo monteCarlo(const EgoVelocityEstimator& estimator, const Eigen::Vector3d& v, const Noise& noise,
                      double elevation_spread, int trials = 4000) {
  Random random(20);
  MonteCarlo result;
  for (int trial = 0; trial < trials; ++trial) {
    // Velocities around v, so that the quantisation is not the same each time.
    const Eigen::Vector3d truth =
        v + 0.1 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    const EgoVelocity e = estimator.estimate(staticScene(truth, 45, noise, random, elevation_spread));
    EXPECT_EQ(e.status, EgoVelocityStatus::kMoving);
    const Eigen::Vector3d error = e.v_R - truth;
    result.bias += error / trials;
    result.rms += error.cwiseAbs2() / trials;
    result.nees += error.dot(e.covariance.llt().solve(error)) / trials;
  }
  result.rms = result.rms.cwiseSqrt();
  return result;
}

MonteCarlo monteCarlo(const EgoVelocityOptions& options, const Eigen::Vector3d& v, const Noise& noise,
                      double elevation_spread) {
  return monteCarlo(EgoVelocityEstimator(options), v, noise, elevation_spread);
}

// Little spread in elevation and noisy elevations: where least squares falls short of the vertical velocity
// most.
const Noise kDirectionNoise{0.03, 0.05, 0.03, 0.125};
const Eigen::Vector3d kClimb(0.2, 1.5, 0.6);

TEST(EgoVelocityBias, LeastSquaresFallsShort) {
  const MonteCarlo ls =
      monteCarlo(bareOptions(EgoVelocitySolver::kLeastSquares), kClimb, kDirectionNoise, 0.25);
  EXPECT_LT(ls.bias.z(), -0.04);  // of 0.6 m/s: the reason for the other solver
  EXPECT_GT(ls.nees, 4.0);
}

TEST(EgoVelocityBias, ErrorsInVariablesDoesNot) {
  const EgoVelocityOptions o = bareOptions(EgoVelocitySolver::kErrorsInVariables);
  const MonteCarlo ls =
      monteCarlo(bareOptions(EgoVelocitySolver::kLeastSquares), kClimb, kDirectionNoise, 0.25);
  const MonteCarlo eiv = monteCarlo(o, kClimb, kDirectionNoise, 0.25);
  EXPECT_LT(eiv.bias.cwiseAbs().maxCoeff(), 0.01);
  EXPECT_LT(eiv.rms.z(), 0.9 * ls.rms.z());
  EXPECT_NEAR(eiv.nees, 3.0, 0.5);
}

TEST(EgoVelocityBias, FastPlatform) {
  const Eigen::Vector3d fast(0.5, 5.0, 1.0);
  const MonteCarlo ls =
      monteCarlo(bareOptions(EgoVelocitySolver::kLeastSquares), fast, kDirectionNoise, 0.35);
  const MonteCarlo eiv =
      monteCarlo(bareOptions(EgoVelocitySolver::kErrorsInVariables), fast, kDirectionNoise, 0.35);
  EXPECT_LT(eiv.rms.z(), ls.rms.z());
  EXPECT_LT(eiv.rms.y(), ls.rms.y());
  EXPECT_LT(eiv.bias.cwiseAbs().maxCoeff(), 0.02);
  EXPECT_NEAR(eiv.nees, 3.0, 0.6);
}

TEST(EgoVelocityBias, DefaultCovarianceIsNotTooSmall) {
  const MonteCarlo result = monteCarlo(EgoVelocityOptions(), kClimb, kDirectionNoise, 0.25);
  EXPECT_LT(result.nees, 3.0);
  EXPECT_GT(result.nees, 0.8);  // nor so large that it says nothing
}

// --- Noise that is learned
// ------------------------------------------------------------------------------------------

/// Scans as a run brings them: at `v` and up to a quarter slower or faster; `ghosts` of the points anywhere.
void learnFrom(EgoVelocityEstimator& estimator, const Eigen::Vector3d& v, const Noise& noise, int scans,
               double ghosts = 0.0, double elevation_spread = 0.35) {
  Random random(40);
  for (int i = 0; i < scans; ++i) {
    RadarScan scan = staticScene(random.uniform(0.75, 1.25) * v, 45, noise, random, elevation_spread);
    for (RadarPoint& p : scan.points) {
      if (random.uniform(0.0, 1.0) < ghosts) p.doppler = random.uniform(-2.5, 2.5);
    }
    estimator.learn(scan, estimator.estimate(scan));
  }
}

EgoVelocityOptions startingAt(double azimuth, double elevation, double doppler) {
  EgoVelocityOptions o = bareOptions(EgoVelocitySolver::kErrorsInVariables);
  o.azimuth_sigma = azimuth;
  o.elevation_sigma = elevation;
  o.doppler_sigma = doppler;
  return o;
}

void expectLearned(const EgoVelocityEstimator& estimator, const Noise& truth, double share) {
  const PointVariances& noise = estimator.noise();
  EXPECT_NEAR(std::sqrt(noise.azimuth), truth.azimuth, share * truth.azimuth);
  EXPECT_NEAR(std::sqrt(noise.elevation), truth.elevation, share * truth.elevation);
  // Half of the step hides it.
  EXPECT_NEAR(std::sqrt(noise.doppler), truth.doppler, 0.01);
}

const Noise kSimulatedRadar{0.0436, 0.0785, 0.02, 0.125};  // 2.5 deg, 4.5 deg
const Eigen::Vector3d kDrive(0.1, 3.0, 0.15);

const std::vector<EgoVelocityOptions> kWrongStarts = {
    startingAt(0.01, 0.02, 0.01), startingAt(0.1, 0.15, 0.1), startingAt(0.03, 0.05, 0.035)};

TEST(EgoVelocityNoise, IsLearnedFromWrongStarts) {
  for (const EgoVelocityOptions& o : kWrongStarts) {
    for (const Eigen::Vector3d& v : {kDrive, Eigen::Vector3d(0.3, 1.0, 0.2)}) {
      EgoVelocityEstimator estimator(o);
      learnFrom(estimator, v, kSimulatedRadar, 1000);
      expectLearned(estimator, kSimulatedRadar, 0.1);
    }
  }
}

TEST(EgoVelocityNoise, GhostsDoNotBlowItUp) {
  for (const EgoVelocityOptions& o : kWrongStarts) {
    EgoVelocityEstimator estimator(o);
    learnFrom(estimator, kDrive, kSimulatedRadar, 1000, 0.2);
    expectLearned(estimator, kSimulatedRadar, 0.15);
  }
}

TEST(EgoVelocityNoise, LeavesNoBiasOnceLearned) {
  for (const EgoVelocityOptions& o : kWrongStarts) {
    EgoVelocityEstimator estimator(o);
    learnFrom(estimator, kDrive, kSimulatedRadar, 1000);
    const MonteCarlo result = monteCarlo(estimator, kDrive, kSimulatedRadar, 0.35, 12000);
    EXPECT_LT(result.bias.cwiseAbs().maxCoeff(), 0.003) << result.bias.transpose();
    EXPECT_NEAR(result.nees, 3.0, 0.4);
  }
  // What they come to unlearned: the reason for all this.
  const MonteCarlo unlearned = monteCarlo(kWrongStarts.back(), kDrive, kSimulatedRadar, 0.35);
  EXPECT_GT(unlearned.bias.cwiseAbs().maxCoeff(), 0.008);
}

TEST(EgoVelocityNoise, GoodDirectionsAreNotOvercompensated) {
  const Noise good{0.005, 0.008, 0.01, 0.125};
  EgoVelocityEstimator estimator(bareOptions(EgoVelocitySolver::kErrorsInVariables));
  learnFrom(estimator, kVelocity, good, 1000);
  const MonteCarlo ls = monteCarlo(bareOptions(EgoVelocitySolver::kLeastSquares), kVelocity, good, 0.35);
  const MonteCarlo eiv = monteCarlo(estimator, kVelocity, good, 0.35);
  EXPECT_LT(eiv.bias.cwiseAbs().maxCoeff(), 0.003);
  EXPECT_LT(eiv.rms.z(), 1.05 * ls.rms.z());
  EXPECT_NEAR(eiv.nees, 3.0, 0.4);
}

TEST(EgoVelocityNoise, AnAngleThatTheMotionDoesNotShowStaysAsItWas) {
  // Upwards, the azimuth does not change the Doppler.
  EgoVelocityEstimator estimator(startingAt(0.03, 0.05, 0.035));
  learnFrom(estimator, {0.0, 0.0, 1.5}, kSimulatedRadar, 1000);
  EXPECT_NEAR(std::sqrt(estimator.noise().azimuth), 0.03, 0.003);
  EXPECT_NEAR(std::sqrt(estimator.noise().elevation), 0.0785, 0.008);
}

TEST(EgoVelocityNoise, NoneIsLearnedSafely) {
  for (const double step : {0.0, 0.125}) {
    for (const double start : {0.0, 0.05}) {
      EgoVelocityOptions o = startingAt(start, start, start);
      o.doppler_quantization = step > 0.0 ? step : kNoStep;
      o.ransac_inlier_threshold = 0.15;  // by default, a start of zero would leave a narrow one
      EgoVelocityEstimator estimator(o);
      learnFrom(estimator, kDrive, {0.0, 0.0, 0.0, step}, 1000);
      const PointVariances& noise = estimator.noise();
      for (const double variance : {noise.doppler, noise.azimuth, noise.elevation}) {
        EXPECT_GE(variance, 0.0);
        EXPECT_LT(variance, 1e-4);
      }
      Random random(41);
      const EgoVelocity e = estimator.estimate(staticScene(kDrive, 45, {0, 0, 0, step}, random));
      EXPECT_EQ(e.status, EgoVelocityStatus::kMoving);
      EXPECT_LT((e.v_R - kDrive).norm(), 0.002 + 0.5 * step);
      EXPECT_TRUE(e.covariance.allFinite());
      // And what comes after is learned again; slowly where even the step did not prepare for it.
      learnFrom(estimator, kDrive, {0.0436, 0.0785, 0.02, step}, 3000);
      expectLearned(estimator, kSimulatedRadar, step > 0.0 ? 0.15 : 0.35);
    }
  }
}

TEST(EgoVelocityNoise, IsNotLearnedWithoutNeed) {
  const EgoVelocityOptions o = startingAt(0.03, 0.05, 0.035);
  Random random(42);
  const auto learns = [&](EgoVelocityEstimator estimator, const Eigen::Vector3d& v) {
    const double before = estimator.noise().elevation;
    const RadarScan scan = staticScene(v, 45, kSimulatedRadar, random);
    estimator.learn(scan, estimator.estimate(scan));
    return estimator.noise().elevation != before;
  };
  EXPECT_TRUE(learns(EgoVelocityEstimator(o), kDrive));
  EXPECT_FALSE(learns(EgoVelocityEstimator(o), Eigen::Vector3d::Zero()));
  EXPECT_FALSE(learns(EgoVelocityEstimator(o), {0.0, 0.4, 0.0}));  // the step hides too much
  EXPECT_FALSE(learns(EgoVelocityEstimator(bareOptions(EgoVelocitySolver::kLeastSquares)), kDrive));
}

// --- The prior
// ------------------------------------------------------------------------------------------------------

/// 22 static points, and 25 of an object that fills one side and moves.
RadarScan sceneWithObject(const Eigen::Vector3d& v_R, const Eigen::Vector3d& object_v_R, Random& random) {
  RadarScan scan = staticScene(v_R, 22, {0.01, 0.02, 0.01, 0.125}, random);
  for (int i = 0; i < 25; ++i) {
    const Eigen::Vector3d u = direction(random.uniform(0.2, 0.9), random.uniform(-0.35, 0.35));
    scan.points.push_back({3.0 * u, 0.125 * std::round(-u.dot(v_R - object_v_R) / 0.125), 20.0});
  }
  return scan;
}

TEST(EgoVelocityPrior, TellsTheStaticWorldFromAnObject) {
  const EgoVelocityEstimator estimator{EgoVelocityOptions()};
  Random random(30);
  VelocityPrior prior;
  prior.covariance = 0.05 * 0.05 * Eigen::Matrix3d::Identity();
  int unaided_wrong = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const RadarScan scan = sceneWithObject(kVelocity, {0.8, 0.9, 0.0}, random);
    prior.v_R = kVelocity + 0.05 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    if ((estimator.estimate(scan).v_R - kVelocity).norm() > 0.3) ++unaided_wrong;
    const EgoVelocity aided = estimator.estimate(scan, prior);
    ASSERT_TRUE(isValid(aided.status)) << trial;
    EXPECT_LT((aided.v_R - kVelocity).norm(), 0.3) << trial;
  }
  EXPECT_GT(unaided_wrong, 50);  // the scene is as hard as it is meant to be
}

TEST(EgoVelocityPrior, AWrongOneIsOverruled) {
  const EgoVelocityEstimator estimator{EgoVelocityOptions()};
  Random random(31);
  const RadarScan scan = staticScene(kVelocity, 40, {0.01, 0.02, 0.01, 0.125}, random);
  VelocityPrior prior;
  prior.covariance = 1e-6 * Eigen::Matrix3d::Identity();  // and sure of itself
  const EgoVelocity unaided = estimator.estimate(scan);
  for (const double off : {0.2, 0.5, 2.0}) {
    prior.v_R = kVelocity + Eigen::Vector3d(off, -off, 0);
    const EgoVelocity aided = estimator.estimate(scan, prior);
    EXPECT_EQ(aided.v_R, unaided.v_R) << off;
  }
}

// What the IMU leaves vague, where it is blind, must not find a few points that side with it.
TEST(EgoVelocityPrior, AVagueOneIsOneWitnessMore) {
  const EgoVelocityEstimator estimator{EgoVelocityOptions()};
  Random random(33);
  const Eigen::Vector3d object_v_R(0.8, 0.9, 0.0);
  VelocityPrior prior;
  prior.covariance = 0.25 * 0.25 * Eigen::Matrix3d::Identity();
  int unaided_wrong = 0;
  for (int trial = 0; trial < 50; ++trial) {
    // Four fifths are static; the prior sides with the object.
    RadarScan scan = staticScene(kVelocity, 40, {0.01, 0.02, 0.01, 0.125}, random);
    const RadarScan object = sceneWithObject(kVelocity, object_v_R, random);
    scan.points.insert(scan.points.end(), object.points.end() - 10, object.points.end());
    prior.v_R = kVelocity - object_v_R;
    const EgoVelocity overruled = estimator.estimate(scan, prior);
    ASSERT_TRUE(isValid(overruled.status)) << trial;
    EXPECT_LT((overruled.v_R - kVelocity).norm(), 0.3) << trial;

    // About as many of each: it decides.
    const RadarScan even = sceneWithObject(kVelocity, object_v_R, random);
    if ((estimator.estimate(even).v_R - kVelocity).norm() > 0.3) ++unaided_wrong;
    VelocityPrior nearer = prior;
    nearer.v_R = kVelocity + Eigen::Vector3d(0.1, -0.1, 0.05);
    nearer.covariance = 0.12 * 0.12 * Eigen::Matrix3d::Identity();
    const EgoVelocity aided = estimator.estimate(even, nearer);
    EXPECT_LT((aided.v_R - kVelocity).norm(), 0.3) << trial;
  }
  EXPECT_GT(unaided_wrong, 25);
}

TEST(EgoVelocityPrior, WhereItCannotDecideTheScanIsAmbiguous) {
  const EgoVelocityEstimator estimator{EgoVelocityOptions()};
  Random random(34);
  const Eigen::Vector3d object_v_R(0.8, 0.9, 0.0);
  VelocityPrior prior;
  prior.v_R = kVelocity;
  int ambiguous = 0;
  for (int trial = 0; trial < 50; ++trial) {
    // Most are of the object, but not all.
    RadarScan scan = staticScene(kVelocity, 19, {0.01, 0.02, 0.01, 0.125}, random);
    const RadarScan object = sceneWithObject(kVelocity, object_v_R, random);
    scan.points.insert(scan.points.end(), object.points.end() - 25, object.points.end());
    prior.covariance = 0.4 * 0.4 * Eigen::Matrix3d::Identity();
    const EgoVelocity undecided = estimator.estimate(scan, prior);
    if (undecided.status == EgoVelocityStatus::kAmbiguous) {
      ++ambiguous;
    } else {
      EXPECT_LT((undecided.v_R - kVelocity).norm(), 0.3) << "the draws found the world " << trial;
    }
    prior.covariance = 0.05 * 0.05 * Eigen::Matrix3d::Identity();
    EXPECT_LT((estimator.estimate(scan, prior).v_R - kVelocity).norm(), 0.3) << trial;
  }
  EXPECT_GT(ambiguous, 40);
}

TEST(EgoVelocityPrior, AGoodOneAddsNoInformation) {
  const EgoVelocityEstimator estimator{EgoVelocityOptions()};
  Random random(32);
  const RadarScan scan = staticScene(kVelocity, 40, {0.01, 0.02, 0.01, 0.125}, random);
  VelocityPrior prior;
  prior.v_R = kVelocity;
  prior.covariance = 1e-4 * Eigen::Matrix3d::Identity();
  const EgoVelocity unaided = estimator.estimate(scan);
  const EgoVelocity aided = estimator.estimate(scan, prior);
  EXPECT_EQ(aided.v_R, unaided.v_R);
  EXPECT_EQ(aided.covariance, unaided.covariance);
}

}  // namespace
}  // namespace rio_t
