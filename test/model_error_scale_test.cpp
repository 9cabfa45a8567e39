// The scale of the model errors: found from innovations, whatever part of their variance it multiplies.
#include "rio_t/odometry/model_error_scale.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "noise.h"

namespace rio_t {
namespace {

/// Feeds scans at 10 Hz whose innovations have the variance `fixed` + `truth` * `scaled` per axis, where the
/// options say `fixed` + `scaled` [m^2/s^2].
struct Scans {
  Scans(double fixed_in, double scaled_in, double truth_in)
      : fixed(fixed_in), scaled(scaled_in), truth(truth_in) {}
  void feed(ModelErrorScale& scale, double seconds) {
    for (double end = time + seconds; time < end; time += 0.1) {
      const Eigen::Vector3d d = std::sqrt(fixed + truth * scaled) * noise.vector();
      const double variance = fixed + scale.value() * scaled;
      scale.add(Time::fromSeconds(time), d.squaredNorm() / variance, scale.value() * scaled / variance);
    }
  }
  double fixed, scaled, truth;
  Noise noise;
  double time = 1000.0;
};

TEST(ModelErrorScale, IsFoundWhereItIsAllThereIs) {
  for (const double truth : {0.1, 1.0, 4.0}) {
    ModelErrorScale scale;
    Scans scans(0.0, 1.6e-3, truth);
    scans.feed(scale, 120.0);
    EXPECT_NEAR(scale.value() / truth, 1.0, 0.15) << truth;
  }
}

TEST(ModelErrorScale, IsFoundBesideMeasuredNoise) {
  for (const double truth : {0.2, 1.0, 4.0}) {
    ModelErrorScale scale;
    Scans scans(1.0e-3, 1.6e-3, truth);
    scans.feed(scale, 120.0);
    EXPECT_NEAR(scale.value() / truth, 1.0, truth < 1.0 ? 0.5 : 0.25) << truth;
  }
}

TEST(ModelErrorScale, FallsToNothingWhereTheMeasuredNoiseIsAll) {
  ModelErrorScale scale;
  Scans scans(1.0e-3, 1.6e-3, 0.0);
  scans.feed(scale, 120.0);
  EXPECT_LT(scale.value(), 0.06);
  // And comes back within seconds.
  scans.truth = 2.0;
  scans.feed(scale, 30.0);
  EXPECT_GT(scale.value(), 1.0);
}

TEST(ModelErrorScale, StaysWithinItsBoundsAndIsNotMovedByOneOutlier) {
  ModelErrorScale scale;
  Scans scans(0.0, 1.6e-3, 1.0);
  scans.feed(scale, 60.0);
  const double before = scale.value();
  scale.add(Time::fromSeconds(scans.time), 1.0e6, 1.0);
  EXPECT_LT(scale.value(), 1.03 * before);
  for (int i = 0; i < 10000; ++i) scale.add(Time::fromSeconds(2000.0 + 0.1 * i), 1.0e6, 1.0);
  EXPECT_LE(scale.value(), 100.0);
  for (int i = 0; i < 10000; ++i) scale.add(Time::fromSeconds(4000.0 + 0.1 * i), 0.0, 1.0);
  EXPECT_GE(scale.value(), 0.01);
}

TEST(ModelErrorScale, OneOutlierAtTheStartMovesItByItsLikelihood) {
  double largest = 0.0;
  for (double share = 0.05; share < 1.01; share += 0.05) {
    ModelErrorScale scale;
    scale.add(Time::fromSeconds(1000.0), 1.0e6, share);
    EXPECT_GT(scale.value(), 1.0) << share;
    // Largest where the outlier counts as much as the belief: exp(13 / (4 sqrt(8))).
    EXPECT_LT(scale.value(), 3.16) << share;
    largest = std::max(largest, scale.value());
  }
  EXPECT_GT(largest, 3.0);
  // And it is forgotten within some seconds.
  ModelErrorScale scale;
  Scans scans(0.0, 1.6e-3, 1.0);
  scale.add(Time::fromSeconds(scans.time), 1.0e6, 1.0);
  scans.feed(scale, 20.0);
  EXPECT_NEAR(scale.value(), 1.0, 0.4);
}

}  // namespace
}  // namespace rio_t
