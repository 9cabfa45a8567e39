#include "rio_t/odometry/imu_propagator.h"

#include <gtest/gtest.h>

#include <cmath>

#include "noise.h"

namespace rio_t {
namespace {

// The history is bounded. An anchor before its first sample would leave out the motion up to that sample.
TEST(ImuPropagator, AnAnchorOlderThanItsHistoryIsNotTaken) {
  ImuPropagator propagator(ImuNoise(), {0.0, 0.0, -9.81});
  ImuMeasurement imu;
  imu.acceleration = {0.0, 0.0, 9.81};
  NavigationState state;
  state.time = Time::fromSeconds(100.0);
  imu.time = state.time;
  propagator.add(imu);
  propagator.anchor(state);
  for (int i = 1; i <= 4000; ++i) {
    imu.time = state.time + 0.01 * i;
    propagator.add(imu);
  }
  state.p_W.x() = 7.0;
  state.time = imu.time - 31.0;
  propagator.anchor(state);
  EXPECT_EQ(propagator.state()->p_W.x(), 0.0);
  state.time = imu.time - 29.0;
  propagator.anchor(state);
  EXPECT_EQ(propagator.state()->p_W.x(), 7.0);
  EXPECT_EQ(propagator.state()->time, imu.time);
}

TEST(ImuPropagator, KeepsWhatAnAnchorNeedsOfTheSamplesBefore) {
  ImuPropagator all(ImuNoise(), {0.0, 0.0, -9.81});
  NavigationState state;
  state.time = Time::fromSeconds(100.0);
  all.anchor(state);
  ImuMeasurement imu;
  for (int i = 0; i <= 1000; ++i) {
    imu.time = state.time + 0.01 * i;
    imu.angular_velocity = {0.1 * std::sin(0.1 * i), 0.2, 0.0};
    imu.acceleration = {0.5 * std::cos(0.3 * i), 0.0, 9.81};
    all.add(imu);
  }
  ImuPropagator few = all;
  const Time oldest = imu.time - 2.0;
  few.dropBefore(oldest);
  state.time = oldest - 0.1;
  few.anchor(state);
  EXPECT_EQ(few.state()->p_W, all.state()->p_W) << "the samples after this anchor are gone: it is not taken";
  state.time = oldest + 0.005;  // between two samples
  state.p_W.x() = 7.0;
  few.anchor(state);
  all.anchor(state);
  EXPECT_EQ(few.state()->p_W, all.state()->p_W);
  EXPECT_EQ(few.state()->covariance, all.state()->covariance);
  EXPECT_GT(few.state()->p_W.x(), 6.0);
}

// The noise of the shaking frame is no motion; a velocity beyond five sigma of it is.
TEST(ImuPropagator, StandsStillAtRestOnAFrameThatShakesUntilItMoves) {
  ImuPropagator propagator(ImuNoise(), {0.0, 0.0, -9.81});
  NavigationState rest;
  rest.time = Time::fromSeconds(100.0);
  rest.p_W = {1.0, 2.0, 3.0};
  propagator.anchor(rest, true);
  ImuMeasurement imu;
  imu.accel_noise = imu.accel_mean_noise = 0.1 * 0.1;  // [m^2/s^3]
  int samples = 0;
  const auto feed = [&](double acceleration) {
    for (int k = 0; k <= 40; ++k, ++samples) {
      imu.time = rest.time + 0.005 * samples;
      imu.acceleration = {acceleration, 0.0, 9.81};
      propagator.add(imu);
    }
  };
  feed(0.3);  // 0.06 m/s, with a sigma of 0.1 sqrt(0.2) = 0.045
  EXPECT_EQ(propagator.state()->v_W.x(), 0.0);
  EXPECT_EQ(propagator.state()->p_W, rest.p_W);
  feed(2.0);
  EXPECT_GT(propagator.state()->v_W.x(), 0.4);
  EXPECT_GT(propagator.state()->p_W.x(), 1.0);
}

TEST(ImuPropagator, ShowsNoMotionInTenMinutesOfRestOnAFrameThatShakes) {
  ImuPropagator propagator(ImuNoise(), {0.0, 0.0, -9.81});
  Noise draw(7);
  ImuMeasurement imu;
  imu.accel_noise = imu.accel_mean_noise = 0.1 * 0.1;  // [m^2/s^3]
  int moving = 0;
  for (int scan = 0; scan < 6000; ++scan) {
    NavigationState rest;
    rest.time = Time::fromSeconds(100.0 + 0.1 * scan);
    propagator.anchor(rest, true);
    for (int k = 1; k <= 10; ++k) {
      imu.time = rest.time + 0.01 * k;
      for (int i = 0; i < 3; ++i) imu.acceleration[i] = draw();  // 0.1 / sqrt(0.01)
      imu.acceleration.z() += 9.81;
      propagator.add(imu);
    }
    if (propagator.state()->v_W.norm() > 0.0) ++moving;
  }
  EXPECT_EQ(moving, 0);
}

}  // namespace
}  // namespace rio_t
