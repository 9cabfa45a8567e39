// What a prediction decides: which points are the static world.
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <vector>

#include "rio_t/radar/ego_velocity.h"
#include "static_scene.h"

namespace rio_t {
namespace {

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
  const EgoVelocityEstimator estimator{knownStep()};
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
  const EgoVelocityEstimator estimator{knownStep()};
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

TEST(EgoVelocityPrior, AGoodOneAddsNoInformation) {
  const EgoVelocityEstimator estimator{knownStep()};
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

TEST(EgoVelocityPrior, AroundAPredictionMostPointsHaveToAgree) {
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

}  // namespace
}  // namespace rio_t
