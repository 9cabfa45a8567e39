// Velocity of one scan: what it takes, what it gives, and why it gives none.
#include "rio_t/radar/ego_velocity.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <limits>
#include <set>
#include <string>

#include "rio_t/radar/point_filter.h"
#include "static_scene.h"

namespace rio_t {
namespace {

TEST(EgoVelocity, ExactWithoutNoise) {
  for (const EgoVelocitySolver solver :
       {EgoVelocitySolver::kLeastSquares, EgoVelocitySolver::kErrorsInVariables}) {
    EgoVelocityOptions o = bareOptions(solver);
    o.azimuth_sigma = o.elevation_sigma = o.doppler_sigma = 0.0;
    o.doppler_quantization = kNoStep;
    Random random(1);
    const EgoVelocity e = EgoVelocityEstimator(o).estimate(staticScene(kVelocity, 30, {}, random));
    EXPECT_EQ(e.status, EgoVelocityStatus::kMoving);
    EXPECT_LT((e.v_R - kVelocity).norm(), 1e-9) << "solver " << static_cast<int>(solver);
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
  const EgoVelocity e = EgoVelocityEstimator(knownStep(kNoStep)).estimate(scan);
  EXPECT_EQ(e.status, EgoVelocityStatus::kMoving);
  EXPECT_NEAR(e.v_R.y(), 1.0, 0.02);
  EXPECT_NEAR(e.v_R.x(), 0.0, 0.02);
  EXPECT_NEAR(e.v_R.z(), 0.0, 0.05);
}

TEST(EgoVelocity, FortyPercentOutliers) {
  Random random(2);
  EgoVelocityEstimator estimator{EgoVelocityOptions()};
  for (int trial = 0; trial < 200; ++trial) {
    RadarScan scan = staticScene(kVelocity, 50, {0.01, 0.02, 0.01, 0.125}, random);
    for (std::size_t i = 0; i < scan.points.size(); i += 5) {  // two of five
      for (const std::size_t k : {i, i + 1}) {
        const double sign = random.uniform(-1, 1) < 0 ? -1 : 1;
        scan.points[k].doppler += sign * random.uniform(0.6, 3.0);
      }
    }
    estimator.observe(scan);
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

// As a radar does that finds two peaks in the spectrum of the angles of one echo.
TEST(EgoVelocity, AnEchoAtTwoDirectionsDoesNotTurnIt) {
  const EgoVelocityEstimator estimator{knownStep(0.25)};
  Random random(5);
  Eigen::Vector3d marked = Eigen::Vector3d::Zero(), unmarked = Eigen::Vector3d::Zero();
  constexpr int kTrials = 500;
  for (int trial = 0; trial < kTrials; ++trial) {
    RadarScan scan = staticScene(kVelocity, 40, {0.02, 0.04, 0.02, 0.25}, random);
    for (std::size_t i = 0; i < 40; ++i) {
      RadarPoint& p = scan.points[i];
      p.snr_db = random.uniform(10.0, 30.0);
      if (i % 3 != 0) continue;
      RadarPoint ghost = p;
      ghost.position_R = p.position_R.norm() * direction(0.9, -0.6);
      scan.points.push_back(ghost);
    }
    unmarked += (estimator.estimate(scan).v_R - kVelocity) / kTrials;
    markAmbiguous(scan.points);
    marked += (estimator.estimate(scan).v_R - kVelocity) / kTrials;
  }
  EXPECT_LT(marked.norm(), 0.02) << marked.transpose();
  EXPECT_GT(unmarked.norm(), 0.05) << "nothing to leave out: " << unmarked.transpose();
}

void observe(EgoVelocityEstimator& estimator, double step, Random& random) {
  for (int i = 0; i < 10; ++i) estimator.observe(staticScene(kVelocity, 40, {0, 0, 0.035, step}, random));
}

TEST(EgoVelocity, WhatFollowsFromTheStepFollowsIt) {
  Random random(13);
  EgoVelocityEstimator estimator{EgoVelocityOptions()};
  const auto expect = [&](double step, DopplerSource source, double inlier, double zero) {
    EXPECT_EQ(estimator.knowledge().doppler_step.source, source);
    EXPECT_NEAR(estimator.options().doppler_quantization, step, 1e-9);
    EXPECT_NEAR(estimator.noise().quantization, step * step / 12.0, 1e-9);
    EXPECT_NEAR(estimator.options().ransac_inlier_threshold, inlier, 1e-9);
    EXPECT_NEAR(estimator.options().zero_velocity_threshold, zero, 1e-9);
  };
  expect(0.5, DopplerSource::kUnknown, 0.25 + 2.5 * 0.035, 0.25);
  observe(estimator, 0.125, random);
  expect(0.125, DopplerSource::kData, 0.15, 0.0625);
  observe(estimator, 0.0, random);
  expect(0.0, DopplerSource::kData, 2.5 * 0.035, 1.5 * 0.035);
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
  EXPECT_EQ(step.knowledge().doppler_step.source, DopplerSource::kGiven);
  EXPECT_EQ(step.knowledge().read_doppler_step.source, DopplerSource::kData);
  EXPECT_NEAR(step.knowledge().read_doppler_step.value, 0.5, 1e-9);
  EXPECT_EQ(step.options().doppler_quantization, 0.25);
  EXPECT_NEAR(step.options().ransac_inlier_threshold, 0.125 + 2.5 * 0.035, 1e-9);
}

TEST(EgoVelocity, ACoarseRadarIsUsedBeforeItsStepIsKnown) {
  const ScanNoise coarse{0.01, 0.02, 0.035, 0.5};
  const auto inliers = [&](const EgoVelocityEstimator& estimator) {
    Random random(15);
    double sum = 0.0;
    for (int i = 0; i < 200; ++i)
      sum +=
          static_cast<double>(estimator.estimate(staticScene(kVelocity, 40, coarse, random)).inliers.size());
    return sum / (200 * 40);
  };
  EXPECT_LT(inliers(EgoVelocityEstimator(knownStep(0.125))), 0.75);  // the reason for all this
  EXPECT_GT(inliers(EgoVelocityEstimator(EgoVelocityOptions())), 0.95);
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

TEST(EgoVelocity, EachStatusHasItsName) {
  std::set<std::string> names;
  for (const EgoVelocityStatus status :
       {EgoVelocityStatus::kMoving, EgoVelocityStatus::kZeroVelocity, EgoVelocityStatus::kTooFewPoints,
        EgoVelocityStatus::kTooFewInliers, EgoVelocityStatus::kIllConditioned,
        EgoVelocityStatus::kSigmaTooLarge}) {
    names.insert(toString(status));
  }
  EXPECT_EQ(names.size(), 6u);
}

/// Each scan alone shows a velocity, modulo the span that the Dopplers fill. The next scan confirms it.
TEST(EgoVelocity, TheSpanShowsInTheScansAlone) {
  constexpr double kSpan = 3.0;
  const Eigen::Vector3d fast(0.3, 2.4, 0.1);
  for (const double span : {kSpan, 0.0}) {
    Random random(7);
    EgoVelocityEstimator estimator(knownStep());
    RadarScan scan;
    for (int i = 0; i < 20; ++i) {
      scan = staticScene(fast, 40, {0.02, 0.03, 0.02, 0.125}, random);
      scan.stamp = scan.stamp + 0.1 * i;
      for (RadarPoint& p : scan.points) p.doppler = unwrapped(p.doppler, 0.0, span);
      estimator.observe(scan);
      if (i < 5) {
        EXPECT_EQ(estimator.knowledge().doppler_span.value, 0.0) << "few scans may agree by chance";
      }
    }
    EXPECT_NEAR(estimator.knowledge().doppler_span.value, span, span > 0.0 ? 0.13 : 0.0);
    const EgoVelocity e = estimator.estimate(scan);
    EXPECT_EQ(e.status, EgoVelocityStatus::kMoving);
    EXPECT_LT((e.v_R - fast).norm(), 0.3);
  }
}

TEST(EgoVelocity, AScanThatComesTwiceDoesNotConfirmItself) {
  Random random(8);
  EgoVelocityEstimator estimator(knownStep());
  RadarScan scan = staticScene({0.3, 2.4, 0.1}, 40, {0.02, 0.03, 0.02, 0.125}, random);
  for (RadarPoint& p : scan.points) p.doppler = unwrapped(p.doppler, 0.0, 3.0);
  for (int i = 0; i < 20; ++i) estimator.observe(scan);
  EXPECT_EQ(estimator.knowledge().doppler_span.value, 0.0);
}

/// A driver that publishes its last scan again, with a new stamp.
TEST(EgoVelocity, InMotionNoTwoScansAreTheSame) {
  Random random(9);
  EgoVelocityEstimator estimator(knownStep());
  RadarScan scan = staticScene(kVelocity, 40, {0.02, 0.03, 0.02, 0.125}, random);
  scan.stamp = Time::fromSeconds(10.0);
  EXPECT_TRUE(estimator.observe(scan));
  EXPECT_TRUE(estimator.observe(scan)) << "the stamp is the fault";
  for (const double later : {0.05, 0.1}) {
    scan.stamp = Time::fromSeconds(10.0 + later);
    EXPECT_FALSE(estimator.observe(scan)) << later;
  }
  scan.points.front().doppler += 0.125;
  EXPECT_TRUE(estimator.observe(scan));
  // At rest some radars repeat themselves.
  for (RadarPoint& p : scan.points) p.doppler = 0.0;
  for (const double later : {0.2, 0.3}) {
    scan.stamp = Time::fromSeconds(10.0 + later);
    EXPECT_TRUE(estimator.observe(scan)) << later;
  }
}

}  // namespace
}  // namespace rio_t
