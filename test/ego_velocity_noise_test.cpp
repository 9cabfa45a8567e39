// Noise of the points: bias and honesty of the velocity, and noise that is learned.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>
#include <optional>
#include <vector>

#include "rio_t/radar/ego_velocity.h"
#include "static_scene.h"

namespace rio_t {
namespace {

struct MonteCarlo {
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d rms = Eigen::Vector3d::Zero();
  double nees = 0.0;
};

MonteCarlo monteCarlo(const EgoVelocityEstimator& estimator, const Eigen::Vector3d& v, const ScanNoise& noise,
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

MonteCarlo monteCarlo(const EgoVelocityOptions& options, const Eigen::Vector3d& v, const ScanNoise& noise,
                      double elevation_spread) {
  return monteCarlo(EgoVelocityEstimator(options), v, noise, elevation_spread);
}

// Little spread in elevation and noisy elevations: where least squares falls short of the vertical velocity
// most.
const ScanNoise kDirectionNoise{0.03, 0.05, 0.03, 0.125};
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
  const MonteCarlo result = monteCarlo(knownStep(), kClimb, kDirectionNoise, 0.25);
  EXPECT_LT(result.nees, 3.0);
  EXPECT_GT(result.nees, 0.8);  // nor so large that it says nothing
}

/// Scans as a run brings them: at `v` and up to a quarter slower or faster; `ghosts` of the points anywhere.
void learnFrom(EgoVelocityEstimator& estimator, const Eigen::Vector3d& v, const ScanNoise& noise, int scans,
               double ghosts = 0.0, double elevation_spread = 0.35) {
  Random random(40);
  for (int i = 0; i < scans; ++i) {
    RadarScan scan = staticScene(random.uniform(0.75, 1.25) * v, 45, noise, random, elevation_spread);
    for (RadarPoint& p : scan.points) {
      if (random.uniform(0.0, 1.0) < ghosts) p.doppler = random.uniform(-2.5, 2.5);
    }
    estimator.observe(scan);
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

void expectLearned(const EgoVelocityEstimator& estimator, const ScanNoise& truth, double share) {
  const PointVariances& noise = estimator.noise();
  EXPECT_NEAR(std::sqrt(noise.azimuth), truth.azimuth, share * truth.azimuth);
  EXPECT_NEAR(std::sqrt(noise.elevation), truth.elevation, share * truth.elevation);
  // Half of the step hides it.
  EXPECT_NEAR(std::sqrt(noise.doppler), truth.doppler, 0.01);
}

const ScanNoise kSimulatedRadar{0.0436, 0.0785, 0.02, 0.125};  // 2.5 deg, 4.5 deg
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

/// The measured elevations lie farther out than the true ones.
TEST(EgoVelocityNoise, IsLearnedInANarrowView) {
  const ScanNoise much{0.05, 0.14, 0.05, 0.0}, little{0.03, 0.04, 0.02, 0.0};
  for (const auto& [truth, view] : {std::pair{much, 0.5}, {much, 0.35}, {little, 0.25}}) {
    for (EgoVelocityOptions o : kWrongStarts) {
      o.doppler_quantization = kNoStep;
      EgoVelocityEstimator estimator(o);
      learnFrom(estimator, kDrive, truth, 2000, 0.0, view);
      expectLearned(estimator, truth, 0.1);
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

// A slow platform with coarse steps.
TEST(EgoVelocityNoise, OutliersAreLearnedAtAnySpeed) {
  EgoVelocityOptions o = bareOptions(EgoVelocitySolver::kErrorsInVariables);
  o.doppler_quantization = 0.49;
  const ScanNoise coarse{0.02, 0.04, 0.02, 0.49};
  const auto learned = [&](double ghosts) {
    EgoVelocityEstimator estimator(o);
    EXPECT_EQ(estimator.noise().outlier_density, kMaxOutlierDensity);  // sure of nothing
    learnFrom(estimator, {0.1, 1.0, 0.1}, coarse, 300, ghosts);
    return estimator.noise().outlier_density;
  };
  EXPECT_LT(learned(0.0), 0.01);
  const double density = 0.2 / 5.0;  // ghosts over 5 m/s
  EXPECT_NEAR(learned(0.2), density, 0.25 * density);
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
  const MonteCarlo unlearned = monteCarlo(kWrongStarts.front(), kDrive, kSimulatedRadar, 0.35);
  EXPECT_GT(unlearned.bias.cwiseAbs().maxCoeff(), 0.008);
}

/// The points of an object spread by their noise alone. They say nothing of two axes of the velocity.
TEST(EgoVelocityNoise, AnObjectInACornerOfTheViewIsNotTheWorld) {
  const ScanNoise noisy{0.09, 0.07, 0.01, 0.0};
  EgoVelocityOptions o = startingAt(noisy.azimuth, noisy.elevation, noisy.doppler);
  o.doppler_quantization = kNoStep;
  EgoVelocityEstimator estimator(o);
  learnFrom(estimator, kDrive, noisy, 300);
  Random random(44);
  int believed = 0;
  constexpr int kTrials = 1000;
  for (int trial = 0; trial < kTrials; ++trial) {
    RadarScan scan;
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3d u_R =
          direction(0.3 + noisy.azimuth * random.normal(), noisy.elevation * random.normal());
      scan.points.push_back({3.0 * u_R, -1.0 + noisy.doppler * random.normal(), 15.0});
    }
    believed += isValid(estimator.estimate(scan).status) ? 1 : 0;
  }
  EXPECT_LT(believed, kTrials / 20);
}

TEST(EgoVelocityNoise, GoodDirectionsAreNotOvercompensated) {
  const ScanNoise good{0.005, 0.008, 0.01, 0.125};
  EgoVelocityEstimator estimator(bareOptions(EgoVelocitySolver::kErrorsInVariables));
  learnFrom(estimator, kVelocity, good, 1000);
  const MonteCarlo ls = monteCarlo(bareOptions(EgoVelocitySolver::kLeastSquares), kVelocity, good, 0.35);
  const MonteCarlo eiv = monteCarlo(estimator, kVelocity, good, 0.35);
  EXPECT_LT(eiv.bias.cwiseAbs().maxCoeff(), 0.003);
  EXPECT_LT(eiv.rms.z(), 0.95 * ls.rms.z());
  // Bins much wider than the noise say more than J'J.
  EXPECT_LT(eiv.nees, 3.0);
  EXPECT_GT(eiv.nees, 1.5);
}

TEST(EgoVelocityNoise, AnAngleThatTheMotionDoesNotShowStaysAsItWas) {
  // Upwards, the azimuth does not change the Doppler.
  EgoVelocityEstimator estimator(startingAt(0.03, 0.05, 0.035));
  learnFrom(estimator, {0.0, 0.0, 1.5}, kSimulatedRadar, 1000);
  EXPECT_NEAR(std::sqrt(estimator.noise().azimuth), 0.03, 0.003);
  EXPECT_NEAR(std::sqrt(estimator.noise().elevation), 0.0785, 0.008);
}

/// A coarse radar at 1.05 to 1.75 m/s, two to four steps.
TEST(EgoVelocityNoise, IsLearnedWithCoarseSteps) {
  const ScanNoise coarse{0.03, 0.14, 0.03, 0.49};
  EgoVelocityOptions o = startingAt(0.03, 0.05, 0.035);
  o.doppler_quantization = coarse.quantization;
  EgoVelocityEstimator estimator(o);
  learnFrom(estimator, {0.15, 1.3, 0.5}, coarse, 1500);
  EXPECT_NEAR(std::sqrt(estimator.noise().elevation), coarse.elevation, 0.25 * coarse.elevation);
}

/// From a crawl, where all points read zero or the bin beside it, to a walk.
TEST(EgoVelocityNoise, OfTheDopplerIsLearnedAtAnySpeed) {
  for (const double speed : {0.15, 0.3, 0.5, 1.0}) {
    EgoVelocityEstimator estimator(startingAt(0.03, 0.05, 0.035));
    learnFrom(estimator, {0.1 * speed, speed, 0.1 * speed}, kSimulatedRadar, 1500);
    EXPECT_NEAR(std::sqrt(estimator.noise().doppler), kSimulatedRadar.doppler, 0.2 * kSimulatedRadar.doppler)
        << speed;
  }
}

/// [m/s] Learned from ten points a scan in steps of 0.49 m/s. `prior_sigma` [m/s] is that of a prediction on
/// each axis, none if zero.
double dopplerNoiseOfFewPoints(const ScanNoise& truth, double prior_sigma) {
  EgoVelocityOptions o = startingAt(truth.azimuth, truth.elevation, truth.doppler);
  o.doppler_quantization = truth.quantization;
  EgoVelocityEstimator estimator(o);
  Random random(43);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d v_R = random.uniform(0.9, 1.1) * Eigen::Vector3d(0.2, 2.0, 0.2);
    const RadarScan scan = staticScene(v_R, 10, truth, random);
    std::optional<VelocityPrior> prior;
    if (prior_sigma > 0.0) {
      const Eigen::Vector3d error(random.normal(), random.normal(), random.normal());
      prior = {v_R + prior_sigma * error, prior_sigma * prior_sigma * Eigen::Matrix3d::Identity()};
    }
    estimator.observe(scan);
    estimator.learn(scan, estimator.estimate(scan, prior), prior);
  }
  return std::sqrt(estimator.noise().doppler);
}

/// The velocity of ten points may lie anywhere within their bins, and its error passes for noise.
TEST(EgoVelocityNoise, APredictionShowsWhatTheBinsHide) {
  const ScanNoise truth{0.03, 0.05, 0.03, 0.49};
  EXPECT_NEAR(dopplerNoiseOfFewPoints(truth, 0.05), truth.doppler, 0.3 * truth.doppler);
  EXPECT_GT(dopplerNoiseOfFewPoints(truth, 0.0), 2.0 * truth.doppler);  // the reason for the prediction
}

TEST(EgoVelocityNoise, HowFarTheAnglesSpreadIsLearnedAtRestToo) {
  EgoVelocityEstimator estimator((EgoVelocityOptions()));
  Random random(41);
  for (int i = 0; i < 300; ++i)
    estimator.observe(staticScene(Eigen::Vector3d::Zero(), 20, kSimulatedRadar, random, 0.2));
  const AngleSpread& elevations = estimator.noise().elevations;
  const double noise = kSimulatedRadar.elevation * kSimulatedRadar.elevation;
  EXPECT_NEAR(elevations.mean, 0.0, 0.01);
  EXPECT_NEAR(elevations.variance, 0.2 * 0.2 / 3.0 + noise, 0.001);
  EXPECT_NEAR(elevations.within, elevations.variance, 0.0005);  // the scans look the same way
}

TEST(EgoVelocityNoise, ScansThatLookUpAndDownSpreadNoFartherWithin) {
  EgoVelocityEstimator estimator((EgoVelocityOptions()));
  Random random(41);
  for (int i = 0; i < 300; ++i) {
    RadarScan scan = staticScene(Eigen::Vector3d::Zero(), 20, {0, 0, 0.02, 0.125}, random, 0.2);
    const Eigen::AngleAxisd pitch(i % 2 == 0 ? 0.3 : -0.3, Eigen::Vector3d::UnitX());
    for (RadarPoint& p : scan.points) p.position_R = pitch * p.position_R;
    estimator.observe(scan);
  }
  // A pitch moves points at the side less than points ahead.
  const AngleSpread& elevations = estimator.noise().elevations;
  EXPECT_LT(elevations.within, 0.5 * elevations.variance);
  EXPECT_NEAR(elevations.within, 0.2 * 0.2 / 3.0, 0.005);
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
      learnFrom(estimator, kDrive, {0.0436, 0.0785, 0.02, step}, 4000);
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
    estimator.observe(scan);
    estimator.learn(scan, estimator.estimate(scan));
    return estimator.noise().elevation != before;
  };
  EXPECT_TRUE(learns(EgoVelocityEstimator(o), kDrive));
  EXPECT_FALSE(learns(EgoVelocityEstimator(o), Eigen::Vector3d::Zero()));
  EXPECT_FALSE(learns(EgoVelocityEstimator(bareOptions(EgoVelocitySolver::kLeastSquares)), kDrive));
}

}  // namespace
}  // namespace rio_t
