// The cost of a mounting against the whole system that it stands for.
#include "../src/inspection/mounting_cost.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "noise.h"
#include "rio_t/core/so3.h"
#include "synthetic_motion.h"

namespace rio_t {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

const Vector3d kLeverArm(0.1, -0.05, 0.08);
const Matrix3d kR_IR = so3::exp({0.4, 1.1, -0.7}).toRotationMatrix();

struct Recorded {
  InertialTrack track;
  std::vector<RadarVelocity> velocities;
};

/// Velocities of a radar from 2 to 14 s, at this rate.
Recorded record(double radar_rate) {
  const SyntheticMotion motion;
  std::vector<ImuMeasurement> imu;
  for (int i = 0; i <= 16 * 200; ++i) imu.push_back(motion.imuSample(i / 200.0));
  Recorded recorded{InertialTrack(imu, motion.b_g), {}};
  Noise noise;
  for (double t = 2.0; t < 14.0; t += 1.0 / radar_rate) {
    const Vector3d sigma(0.05, 0.03, 0.15);
    recorded.velocities.push_back(
        {motion.time(t),
         motion.radarVelocity(t, kR_IR.transpose(), kLeverArm) + sigma.cwiseProduct(noise.vector()),
         sigma.cwiseAbs2().asDiagonal()});
  }
  return recorded;
}

/// What M and l cost in a window with the best velocity and gravity for them: (52), all velocities at once,
/// with their covariance.
double wholeCost(const Matrix3d& M, const Vector3d& l_I, double offset,
                 const std::optional<Matrix3d>& known_M, const VelocityWindow& window,
                 const MountingProblem& problem) {
  const InertialTrack& track = problem.track;
  const auto count = static_cast<Eigen::Index>(window.size());
  const Time begin = window.front().velocity->stamp - offset;
  MatrixXd A = MatrixXd::Zero(3 * count + 3, 6), covariance = MatrixXd::Zero(3 * count + 3, 3 * count + 3);
  VectorXd y(3 * count + 3);
  for (Eigen::Index i = 0; i < count; ++i) {
    const WeightedVelocity& each = window[static_cast<std::size_t>(i)];
    const Time time = each.velocity->stamp - offset;
    const Matrix3d R = track.rotation(time).toRotationMatrix();
    y.segment<3>(3 * i) = R * (M * each.velocity->v_R - track.rate(time).cross(l_I)) - track.impulse(time) +
                          track.impulse(begin);
    A.block<3, 3>(3 * i, 0).setIdentity();
    A.block<3, 3>(3 * i, 3) = (time - begin) * Matrix3d::Identity();
    // The accelerometer's noise up to the earlier of two velocities is in both.
    const double walked = std::pow(problem.options.accel_density, 2) * (time - begin);
    for (Eigen::Index k = i; k < count; ++k) {
      covariance.block<3, 3>(3 * i, 3 * k) = walked * Matrix3d::Identity();
      covariance.block<3, 3>(3 * k, 3 * i) = walked * Matrix3d::Identity();
    }
    const Matrix3d mean = each.velocity->covariance.trace() / 3.0 * Matrix3d::Identity();
    const Matrix3d turned =
        known_M ? Matrix3d(R * *known_M * each.velocity->covariance * (R * *known_M).transpose()) : mean;
    covariance.block<3, 3>(3 * i, 3 * i) += (turned + 0.08 * 0.08 * Matrix3d::Identity()) / each.weight;
  }
  A.bottomRightCorner<3, 3>().setIdentity();
  y.tail<3>() = track.gravity(begin, 9.81);
  covariance.bottomRightCorner<3, 3>() = 0.5 * 0.5 * Matrix3d::Identity();
  const MatrixXd information = covariance.inverse();
  const VectorXd own = (A.transpose() * information * A).ldlt().solve(A.transpose() * information * y);
  const VectorXd left = y - A * own;
  return left.dot(information * left);
}

TEST(MountingCost, IsThatOfAllVelocitiesOfAWindowAtOnce) {
  const Recorded recorded = record(15.0);
  MountingSearchOptions options;
  options.accel_density = 0.2;  // so that the walk is as large as the noise of the velocities
  MountingProblem problem{recorded.track, options, windowsOf(recorded.velocities, recorded.track, 0.3)};
  ASSERT_GE(problem.windows.size(), 3u);
  int n = 0;
  for (VelocityWindow& window : problem.windows)
    for (WeightedVelocity& each : window) each.weight = 1.0 / (1.0 + n++ % 4);
  for (const std::optional<Matrix3d>& known_M : {std::optional<Matrix3d>(), std::optional<Matrix3d>(kR_IR)}) {
    const double offset = 0.02;
    const Quadratic cost = mountingCost(offset, known_M, problem);
    for (const double apart : {0.0, 0.1, 1.0}) {
      const Matrix3d M = kR_IR + apart * Matrix3d::Ones();
      const Vector3d l_I = kLeverArm + apart * Vector3d::Ones();
      double whole = l_I.squaredNorm() / (0.5 * 0.5);
      for (const VelocityWindow& window : problem.windows)
        whole += wholeCost(M, l_I, offset, known_M, window, problem);
      VectorXd x(kMountingM + kMountingL);
      x << columnsOf(M), l_I;
      EXPECT_NEAR(x.dot(cost.H * x) - 2.0 * cost.b.dot(x) + cost.c, whole, 1e-6 * whole) << apart;
    }
  }
}

/// A weight that a round gave must not make the velocity fit better in the next one.
TEST(MountingCost, AWrongVelocityCountsLessInEachRound) {
  Recorded recorded = record(15.0);
  RadarVelocity& wrong = recorded.velocities[recorded.velocities.size() / 2];
  wrong.v_R += Vector3d(3.0, 0.0, 0.0);
  MountingProblem problem{recorded.track, {}, windowsOf(recorded.velocities, recorded.track, 0.3)};
  for (int round = 0; round < 4; ++round) {
    reweigh(0.0, kR_IR, kLeverArm, &problem);
    double weight_of_wrong = 1.0, least_of_others = 1.0;
    for (const VelocityWindow& window : problem.windows) {
      for (const WeightedVelocity& each : window) {
        double& weight = each.velocity == &wrong ? weight_of_wrong : least_of_others;
        weight = std::min(weight, each.weight);
      }
    }
    EXPECT_LT(weight_of_wrong, 0.05) << round;
    EXPECT_GT(least_of_others, 0.4) << round;
  }
}

}  // namespace
}  // namespace rio_t
