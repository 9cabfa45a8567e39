// The expected angles of a scan: between the measured ones, the mean of the scan, and that of earlier scans.
#include "../src/radar/angle_regression.h"

#include <gtest/gtest.h>

#include <cmath>

#include "noise.h"

namespace rio_t {
namespace {

TEST(AngleRegression, WithoutEarlierScansTheMeasuredAngleIsExpected) {
  const AngleRegression regression({0.1, -0.3, 0.4}, 0.02, AngleSpread());
  EXPECT_DOUBLE_EQ(regression.expected(0.4), 0.4);
  EXPECT_DOUBLE_EQ(regression.remaining(), 0.02);
}

TEST(AngleRegression, WithoutNoiseTheMeasuredAngleIsExpected) {
  const AngleRegression regression({0.1, -0.3, 0.4}, 0.0, {0.2, 0.05, 0.04});
  EXPECT_NEAR(regression.expected(0.4), 0.4, 1e-12);
  EXPECT_NEAR(regression.remaining(), 0.0, 1e-12);
}

/// A radar without elevation may report noise.
TEST(AngleRegression, IfAllIsNoiseTheMeanIsExpected) {
  const AngleRegression regression({0.1, -0.3, 0.5}, 0.05, {0.2, 0.05, 0.05});
  EXPECT_NEAR(regression.expected(0.5), 0.2, 1e-12);
  EXPECT_NEAR(regression.remaining(), 0.0, 1e-12);
}

/// A scan of one point has no spread: what counts is the spread of all points.
TEST(AngleRegression, OnePointIsExpectedBetweenItselfAndTheMeanOfAll) {
  const AngleRegression regression({0.5}, 0.02, {0.1, 0.08, 0.05});
  EXPECT_NEAR(regression.expected(0.5), 0.1 + 0.75 * 0.4, 1e-12);
  EXPECT_NEAR(regression.remaining(), 0.75 * 0.02, 1e-12);
}

/// The error is as large as stated, and does not correlate with the expected angle.
TEST(AngleRegression, ItsErrorDoesNotCorrelateWithIt) {
  const double within = 0.1, of_means = 0.2, noise = 0.12;  // sigmas [rad]
  const AngleSpread spread{0.05, within * within + of_means * of_means + noise * noise,
                           within * within + noise * noise};
  Noise draw(7);
  double variance = 0.0, covariance = 0.0, of_expected = 0.0, remaining = 0.0;
  constexpr int kScans = 20000, kPoints = 5;
  for (int k = 0; k < kScans; ++k) {
    const double mean = spread.mean + of_means * draw();
    std::vector<double> truth, measured;
    for (int i = 0; i < kPoints; ++i) {
      truth.push_back(mean + within * draw());
      measured.push_back(truth.back() + noise * draw());
    }
    const AngleRegression regression(measured, noise * noise, spread);
    remaining = regression.remaining();
    for (int i = 0; i < kPoints; ++i) {
      const double expected = regression.expected(measured[i]);
      const double error = truth[i] - expected;
      variance += error * error / (kScans * kPoints);
      covariance += error * (expected - spread.mean) / (kScans * kPoints);
      of_expected += (expected - spread.mean) * (expected - spread.mean) / (kScans * kPoints);
    }
  }
  EXPECT_NEAR(variance, remaining, 0.02 * remaining);
  EXPECT_LT(std::abs(covariance), 0.02 * of_expected);
}

// A drone climbs: the points come into a narrow band at the edge of the view. The wide scans from before must
// not make noise pass for spread.
TEST(AngleRegression, ARadarThatComesToAnotherViewSeesItsSpread) {
  const double noise = 0.08;
  Noise draw(3);
  PointNoise learned{PointVariances()};
  const auto directions = [&](double within) {
    std::vector<RadarDirection> points;
    for (std::size_t i = 0; i < 40; ++i) {
      const double elevation = within * draw() + noise * draw();
      points.push_back({{0.0, std::cos(elevation), std::sin(elevation)}, 0.0, i});
    }
    return points;
  };
  const auto shareOfTruth = [&](double within) {
    const std::vector<RadarDirection> points = directions(within);
    learned.learnSpread(points);
    std::vector<double> elevations;
    for (const RadarDirection& p : points) elevations.push_back(std::asin(p.u_R.z()));
    const AngleRegression regression(elevations, noise * noise, learned.variances().elevations);
    return regression.expected(1.0) - regression.expected(0.0);
  };
  for (int k = 0; k < 500; ++k) shareOfTruth(0.3);
  EXPECT_GT(learned.variances().elevations.within_freedom, 100.0) << "one view";
  for (int k = 0; k < 20; ++k) shareOfTruth(0.08);
  double share = 0.0;
  for (int k = 0; k < 20; ++k) share += shareOfTruth(0.08) / 20.0;
  // Half of what the narrow view shows is noise. The wide scans alone say 0.93.
  EXPECT_NEAR(share, 0.5, 0.2);
}

}  // namespace
}  // namespace rio_t
