// Rest and slow motion, which the bins of the Doppler hide.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cstddef>

#include "rio_t/radar/ego_velocity.h"
#include "static_scene.h"

namespace rio_t {
namespace {

TEST(EgoVelocityRest, RestWithSomethingMoving) {
  Random random(5);
  RadarScan scan = staticScene(Eigen::Vector3d::Zero(), 40, {}, random);
  for (std::size_t i = 0; i < 9; ++i) scan.points[i].doppler = 0.7;  // under a quarter
  const EgoVelocity e = EgoVelocityEstimator(EgoVelocityOptions()).estimate(scan);
  EXPECT_EQ(e.status, EgoVelocityStatus::kZeroVelocity);
  EXPECT_EQ(e.v_R, Eigen::Vector3d::Zero());
  EXPECT_EQ(e.inliers.size(), 31u);
  for (const std::size_t i : e.inliers) EXPECT_GE(i, 9u);
}

TEST(EgoVelocityRest, RestWithALargeObjectMoving) {
  // More than a quarter moves, so the first test for rest fails; RANSAC then finds that the rest stands
  // still.
  Random random(6);
  RadarScan scan = staticScene(Eigen::Vector3d::Zero(), 40, {}, random);
  for (std::size_t i = 0; i < 15; ++i) scan.points[i].doppler = 0.7 + 0.1 * static_cast<double>(i % 5);
  const EgoVelocity e = EgoVelocityEstimator(EgoVelocityOptions()).estimate(scan);
  EXPECT_EQ(e.status, EgoVelocityStatus::kZeroVelocity);
  EXPECT_EQ(e.inliers.size(), 25u);
}

// Less than a bin, most points read zero, and those along the motion do not.
TEST(EgoVelocityRest, ASlowRideIsNoRestAndHasItsVelocity) {
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

// Far within its bin, a point without Doppler noise says nothing about small changes of the velocity, and the
// curvature of the likelihood vanishes.
TEST(EgoVelocityRest, ASlowRideSeenWithoutNoiseHasACovariance) {
  EgoVelocityOptions o = simulatedRadarOptions();
  o.doppler_sigma = 0.0;
  const EgoVelocityEstimator estimator(o);
  Random random(18);
  int denied = 0;
  double squares = 0.0;
  for (int trial = 0; trial < 1000; ++trial) {
    const Eigen::Vector3d v(random.uniform(-0.15, 0.15), random.uniform(-0.15, 0.15),
                            random.uniform(-0.05, 0.05));
    const EgoVelocity e = estimator.estimate(staticScene(v, 40, {0.0436, 0.0785, 0.0, 0.125}, random));
    if (!e.denies_rest || e.status != EgoVelocityStatus::kMoving) continue;
    ++denied;
    const Eigen::LLT<Eigen::Matrix3d> root(e.covariance);
    ASSERT_EQ(root.info(), Eigen::Success) << e.covariance;
    squares += (e.v_R - v).dot(root.solve(e.v_R - v));
  }
  EXPECT_GT(denied, 500);
  EXPECT_LT(squares / denied, 3.0);
}

TEST(EgoVelocityRest, RestIsNotDeniedByPointsABinOff) {
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

/// Share of the trials in which `points` points of a radar with noise of 0.02 m/s and steps of 0.125 m/s deny
/// rest. `change` changes the points.
template <typename Change>
double shareDenied(double speed, int points, const Change& change) {
  const EgoVelocityEstimator estimator(simulatedRadarOptions());
  Random random(19);
  int denied = 0;
  constexpr int kTrials = 200;
  for (int trial = 0; trial < kTrials; ++trial) {
    RadarScan scan = staticScene({0.0, speed, 0.0}, points, {0.0436, 0.0785, 0.02, 0.125}, random);
    change(scan, random);
    denied += estimator.deniesRest(scan) ? 1 : 0;
  }
  return static_cast<double>(denied) / kTrials;
}

TEST(EgoVelocityRest, ManyPointsTellACreepOfAThirdOfABin) {
  const auto as_drawn = [](RadarScan&, Random&) {};
  EXPECT_LT(shareDenied(0.04, 40, as_drawn), 0.1);  // one scan does not
  EXPECT_GT(shareDenied(0.04, 500, as_drawn), 0.9);
  EXPECT_LT(shareDenied(0.0, 500, as_drawn), 0.01);
}

TEST(EgoVelocityRest, ManyPointsAtRestMayReadABinOff) {
  const auto a_tenth_off = [](RadarScan& scan, Random& random) {
    for (RadarPoint& p : scan.points)
      if (random.uniform(0.0, 1.0) < 0.1) p.doppler += random.uniform(-1.0, 1.0) < 0.0 ? -0.125 : 0.125;
  };
  EXPECT_LT(shareDenied(0.0, 500, a_tenth_off), 0.01);
  // A curtain or a fan: one echo of 40 that is always a bin off.
  const auto one_always_off = [](RadarScan& scan, Random&) {
    for (std::size_t i = 0; i < scan.points.size(); i += 40) {
      scan.points[i].position_R = scan.points[0].position_R;
      scan.points[i].doppler = 0.125;
    }
  };
  EXPECT_LE(shareDenied(0.0, 500, one_always_off), 0.01);
}

// A narrow view has few directions, which agree on some motion by chance.
TEST(EgoVelocityRest, InANarrowViewAFanIsNoMotion) {
  const auto fan = [](RadarScan& scan, Random& random) {
    for (RadarPoint& p : scan.points) {
      p.position_R.x() *= 0.2;
      p.position_R.z() *= 0.3;
      // The right half of the view sees the fan.
      if (p.position_R.x() > 0.1 * p.position_R.y() && random.uniform(0.0, 1.0) < 0.3) p.doppler = 0.125;
    }
  };
  std::printf("denied %.3f\n", shareDenied(0.0, 500, fan));
  EXPECT_LE(shareDenied(0.0, 500, fan), 0.01);
}

// A bin of width q hides every velocity below about q/2; the covariance at rest has to admit that.
TEST(EgoVelocityRest, CoarseDopplerDoesNotFakeRest) {
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

TEST(EgoVelocityRest, ExactDopplerAtRestKeepsTheSigmaGiven) {
  EgoVelocityOptions o;
  o.doppler_quantization = kNoStep;
  o.doppler_sigma = 0.0;
  Random random(8);
  const EgoVelocity e =
      EgoVelocityEstimator(o).estimate(staticScene(Eigen::Vector3d::Zero(), 40, {}, random));
  EXPECT_EQ(e.status, EgoVelocityStatus::kZeroVelocity);
  // A Doppler has at least the noise of 1 mm/s.
  const double variance = o.zero_velocity_sigma * o.zero_velocity_sigma;
  EXPECT_LT((e.covariance - variance * Eigen::Matrix3d::Identity()).norm(), 0.001 * 0.001);
}

}  // namespace
}  // namespace rio_t
