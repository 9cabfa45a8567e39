// The published sigma of the offset: scaled by how the innovations scatter, widened where they ask for a
// change.
#include "rio_t/odometry/offset_uncertainty.h"

#include <gtest/gtest.h>

#include <cmath>

#include "noise.h"

namespace rio_t {
namespace {

constexpr double kPromised = 0.05;     // [m/s] sigma of an axis
constexpr double kAcceleration = 3.0;  // [m/s^2]
const Eigen::Matrix3d kCovariance = kPromised * kPromised * Eigen::Matrix3d::Identity();

/// Feeds `seconds` of scans at 10 Hz whose noise is `sigma` [m/s] and whose offset is off by `lag` [s].
struct Scans {
  void feed(OffsetUncertainty& u, double seconds, double sigma, double lag) {
    for (double end = time + seconds; time < end; time += 0.1) {
      const Eigen::Vector3d J = kAcceleration * Eigen::Vector3d(std::sin(time), std::cos(time), 0.0);
      u.add(Time::fromSeconds(time), sigma * noise.vector() + lag * J, kCovariance, J);
    }
  }
  Noise noise;
  double time = 1000.0;
};

TEST(OffsetUncertainty, BeginsWithTheMarginalSigma) {
  EXPECT_DOUBLE_EQ(OffsetUncertainty(1.5).sigma(4.0e-6), 2.0e-3);
}

TEST(OffsetUncertainty, FollowsTheScatterBothWays) {
  for (const double scale : {0.4, 1.0, 1.5}) {
    OffsetUncertainty u(1.5);
    Scans scans;
    scans.feed(u, 120.0, scale * kPromised, 0.0);
    EXPECT_NEAR(u.sigma(1.0e-4), scale * 1.0e-2, 0.1 * scale * 1.0e-2);
    // An hour without scans is no reason to believe a few.
    scans.time += 3600.0;
    scans.feed(u, 0.35, 3.0 * kPromised, 0.0);
    EXPECT_LT(u.sigma(1.0e-4), 1.6e-2);
  }
}

TEST(OffsetUncertainty, OneScanFarOffIsNoNoise) {
  OffsetUncertainty u(1.5);
  Scans scans;
  scans.feed(u, 60.0, kPromised, 0.0);
  const double before = u.sigma(1.0e-4);
  u.add(Time::fromSeconds(scans.time), Eigen::Vector3d(20.0, 0.0, 0.0), kCovariance,
        Eigen::Vector3d::UnitZ());
  EXPECT_LT(u.sigma(1.0e-4), 1.01 * before);
}

TEST(OffsetUncertainty, WidensWhereTheScansAskForAChangeAllTheTime) {
  const double marginal = 0.2e-3;
  const double lag = 2.0e-3;
  OffsetUncertainty u(1.5);
  Scans scans;
  scans.feed(u, 60.0, 0.5 * kPromised, 0.0);
  const double before = u.sigma(marginal * marginal);
  EXPECT_LT(before, 0.15e-3);
  scans.feed(u, 120.0, 0.5 * kPromised, lag);
  EXPECT_GT(u.sigma(marginal * marginal), 0.6 * lag);
  EXPECT_LT(u.sigma(marginal * marginal), 1.3 * lag);
  // Found anew: what was asked for is done.
  u.offsetStepped();
  EXPECT_LT(u.sigma(marginal * marginal), 0.15e-3);
}

}  // namespace
}  // namespace rio_t
