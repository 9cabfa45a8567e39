// The published sigma of the offset: widened where the innovations ask for a change all the time.
#include "rio_t/sensors/offset_uncertainty.h"

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
      u.add({Time::fromSeconds(time), sigma * noise.vector() + lag * J, kCovariance, kCovariance, J});
    }
  }
  Noise noise;
  double time = 1000.0;
};

TEST(OffsetUncertainty, BeginsWithTheMarginalSigma) {
  EXPECT_DOUBLE_EQ(OffsetUncertainty(1.5).sigma(4.0e-6), 2.0e-3);
}

TEST(OffsetUncertainty, ScatterAsPromisedAddsNothing) {
  OffsetUncertainty u(1.5);
  Scans scans;
  scans.feed(u, 120.0, kPromised, 0.0);
  EXPECT_NEAR(u.sigma(1.0e-4), 1.0e-2, 1.0e-4);
}

TEST(OffsetUncertainty, WidensWhereTheScansAskForAChangeAllTheTime) {
  const double marginal = 0.2e-3;
  const double lag = 2.0e-3;
  OffsetUncertainty u(1.5);
  Scans scans;
  scans.feed(u, 60.0, 0.5 * kPromised, 0.0);
  EXPECT_NEAR(u.sigma(marginal * marginal), marginal, 0.1e-3);
  scans.feed(u, 120.0, 0.5 * kPromised, lag);
  EXPECT_GT(u.sigma(marginal * marginal), 0.8 * lag);
  EXPECT_LT(u.sigma(marginal * marginal), 1.3 * lag);
  EXPECT_NEAR(u.walk(), lag / std::sqrt(40.0), 0.2 * lag / std::sqrt(40.0)) << "over the memory of 40 s";
}

}  // namespace
}  // namespace rio_t
