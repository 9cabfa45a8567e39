// The odometry of a body that is fixed to the IMU: values by hand, covariances by numeric derivatives.
#include "rio_t/odometry/body_odometry.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "rio_t/core/so3.h"
#include "rio_t/factors/state_block.h"
#include "some_state.h"

namespace rio_t {
namespace {

using S = StateBlock;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Vector15 = Eigen::Matrix<double, 15, 1>;

const ImuInBody kMounting{{0.3, -0.2, 0.5}, so3::exp({0.4, 1.1, -0.7})};

WorldInOdom someWorld() {
  WorldInOdom T_OW;
  T_OW.p_O = {4.0, 5.0, -1.0};
  T_OW.q_OW = so3::exp({0.0, 0.0, 0.9});
  return T_OW;
}

/// The state moved by an error, in the order and sense of StateCovariance.
NavigationState moved(NavigationState state, const Vector15& error) {
  state.q_WI = state.q_WI * so3::exp(error.segment<3>(S::kTheta));
  state.p_W += error.segment<3>(S::kP);
  state.v_W += error.segment<3>(S::kV);
  state.angular_velocity -= error.segment<3>(S::kBg);
  return state;
}

/// Derivative of what is said of the state, one column for each direction of `step`.
template <int N>
Eigen::Matrix<double, 6, N> derivative(
    const std::function<Vector6(const Eigen::Matrix<double, N, 1>&)>& said) {
  Eigen::Matrix<double, 6, N> J;
  constexpr double kStep = 1e-6;
  for (int k = 0; k < N; ++k) {
    const Eigen::Matrix<double, N, 1> error = kStep * Eigen::Matrix<double, N, 1>::Unit(k);
    J.col(k) = (said(error) - said(-error)) / (2.0 * kStep);
  }
  return J;
}

/// Position, then the turn about the fixed axes of O from `from`.
Vector6 poseFrom(const BodyOdometry& from, const BodyOdometry& body) {
  Vector6 pose;
  pose << body.p_O, so3::log(body.q_OB * from.q_OB.conjugate());
  return pose;
}

Vector6 twistOf(const BodyOdometry& body) {
  Vector6 twist;
  twist << body.v_B, body.omega_B;
  return twist;
}

TEST(BodyOdometry, OfTheImuIsTheStateItself) {
  const NavigationState state = someState();
  const BodyOdometry body = bodyOdometry(state, 0.0);
  EXPECT_EQ(body.time, state.time);
  EXPECT_LT((body.p_O - state.p_W).norm(), 1e-12);
  EXPECT_LT(so3::log(body.q_OB * state.q_WI.conjugate()).norm(), 1e-12);
  EXPECT_LT((state.q_WI * body.v_B - state.v_W).norm(), 1e-12);
  EXPECT_LT((body.omega_B - state.angular_velocity).norm(), 1e-12);
}

TEST(BodyOdometry, AddsTheLeverArmTimesTheAngularVelocity) {
  // An IMU one metre ahead of base_link, seen on a platform that turns left on the spot: the IMU moves to its
  // left, base_link stands.
  NavigationState state;
  state.p_W = {1.0, 0.0, 0.0};
  state.angular_velocity = {0.0, 0.0, 2.0};
  state.v_W = {0.0, 2.0, 0.0};
  const ImuInBody ahead{{1.0, 0.0, 0.0}, Eigen::Quaterniond::Identity()};
  const BodyOdometry body = bodyOdometry(state, 0.0, ahead);
  EXPECT_LT(body.p_O.norm(), 1e-12);
  EXPECT_LT(body.v_B.norm(), 1e-12);
  EXPECT_LT((body.omega_B - Eigen::Vector3d(0.0, 0.0, 2.0)).norm(), 1e-12);
}

TEST(BodyOdometry, VelocityIsTheDerivativeOfThePosition) {
  const NavigationState now = someState();
  constexpr double kDt = 1e-6;
  const auto at = [&](double dt) {
    NavigationState state = now;
    state.p_W += dt * state.v_W;
    state.q_WI = state.q_WI * so3::exp(dt * state.angular_velocity);
    return bodyOdometry(state, 0.0, kMounting, someWorld());
  };
  const BodyOdometry body = at(0.0);
  const Eigen::Vector3d v_O = (at(kDt).p_O - at(-kDt).p_O) / (2.0 * kDt);
  EXPECT_LT((body.q_OB * body.v_B - v_O).norm(), 1e-8);
  const Eigen::Vector3d omega_B = so3::log(at(-kDt).q_OB.conjugate() * at(kDt).q_OB) / (2.0 * kDt);
  EXPECT_LT((body.omega_B - omega_B).norm(), 1e-8);
}

TEST(BodyOdometry, PoseCovarianceIsThatOfTheNumericDerivative) {
  const NavigationState state = someState();
  const BodyOdometry at = bodyOdometry(state, 0.3, kMounting, someWorld());
  const auto J = derivative<15>([&](const Vector15& error) {
    return poseFrom(at, bodyOdometry(moved(state, error), 0.0, kMounting, someWorld()));
  });
  const Covariance6 expected = J * state.covariance * J.transpose();
  EXPECT_LT((at.pose_covariance - expected).norm(), 1e-8 * expected.norm());
}

TEST(BodyOdometry, TwistCovarianceIsThatOfTheNumericDerivativeWithTheNoiseOfTheSample) {
  const NavigationState state = someState();
  const BodyOdometry at = bodyOdometry(state, 0.3, kMounting, someWorld());
  const auto J = derivative<15>([&](const Vector15& error) {
    return twistOf(bodyOdometry(moved(state, error), 0.0, kMounting, someWorld()));
  });
  const auto G = derivative<3>([&](const Eigen::Vector3d& noise) {
    NavigationState noisy = state;
    noisy.angular_velocity += noise;
    return twistOf(bodyOdometry(noisy, 0.0, kMounting, someWorld()));
  });
  const Covariance6 expected = J * state.covariance * J.transpose() + 0.3 * 0.3 * G * G.transpose();
  EXPECT_LT((at.twist_covariance - expected).norm(), 1e-8 * expected.norm());
}

TEST(BodyOdometry, CovarianceOfTheWorldIsThatOfTheNumericDerivative) {
  const NavigationState state = someState();
  WorldInOdom T_OW = someWorld();
  T_OW.anchor_O = {2.0, -1.0, 0.5};
  const BodyOdometry certain = bodyOdometry(state, 0.0, kMounting, T_OW);
  const auto J = derivative<4>([&](const Eigen::Vector4d& error) {
    WorldInOdom other = T_OW;
    const Eigen::Quaterniond turn = so3::exp({0.0, 0.0, error[3]});
    other.q_OW = turn * T_OW.q_OW;
    other.p_O = T_OW.anchor_O + turn * (T_OW.p_O - T_OW.anchor_O) + error.head<3>();
    return poseFrom(certain, bodyOdometry(state, 0.0, kMounting, other));
  });
  Eigen::Matrix4d L;
  L << 0.3, 0, 0, 0, 0.1, 0.2, 0, 0, -0.1, 0.05, 0.4, 0, 0.02, 0.03, -0.01, 0.1;
  T_OW.covariance = L * L.transpose();
  const Covariance6 expected = J * T_OW.covariance * J.transpose();
  const Covariance6 added =
      bodyOdometry(state, 0.0, kMounting, T_OW).pose_covariance - certain.pose_covariance;
  EXPECT_LT((added - expected).norm(), 1e-8 * expected.norm());
}

NavigationState stateAt(const StampedPose& pose) {
  NavigationState state;
  state.time = pose.time;
  state.p_W = pose.p_W;
  state.q_WI = pose.q_WI;
  return state;
}

TEST(PlaceWorld, LetsTheOdometryBeginAtTheBody) {
  // An IMU on its side, with its x to the left of a level platform.
  StampedPose start;
  const Eigen::Quaterniond q_BI = so3::exp({0.0, 0.0, 0.5 * M_PI}) * so3::exp({0.5 * M_PI, 0.0, 0.0});
  const ImuInBody T_BI{{0.3, -0.2, 0.5}, q_BI};
  // The estimator levels the IMU and knows no heading.
  start.q_WI = Eigen::Quaterniond::FromTwoVectors(q_BI.conjugate() * Eigen::Vector3d::UnitZ(),
                                                  Eigen::Vector3d::UnitZ());
  const BodyOdometry body = bodyOdometry(stateAt(start), 0.0, T_BI, placeWorld(start, T_BI));
  EXPECT_LT(body.p_O.norm(), 1e-12);
  EXPECT_LT(so3::log(body.q_OB).norm(), 1e-12);
}

TEST(PlaceWorld, IsTheWorldItselfIfTheBodyIsTheImu) {
  StampedPose start;
  start.q_WI = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d(0.2, -0.3, 0.9), Eigen::Vector3d::UnitZ());
  const WorldInOdom T_OW = placeWorld(start, {});
  EXPECT_LT(T_OW.p_O.norm(), 1e-12);
  EXPECT_LT(so3::log(T_OW.q_OW).norm(), 1e-12);
  EXPECT_EQ(T_OW.covariance, Eigen::Matrix4d::Zero());
}

TEST(PlaceWorld, ContinuesFromTheLastPoseAndKeepsItsUncertainty) {
  const BodyOdometry last = bodyOdometry(someState(), 0.0, kMounting, someWorld());
  StampedPose start;
  // The platform tilts otherwise than before: gravity shows that.
  start.q_WI = so3::exp({0.0, 0.0, -1.3}) * so3::exp({0.1, 0.2, 0.0}) * last.q_OB * kMounting.q_BI;
  start.p_W = {0.1, 0.2, 0.3};
  const WorldInOdom T_OW = placeWorld(start, kMounting, last);
  const BodyOdometry body = bodyOdometry(stateAt(start), 0.0, kMounting, T_OW);
  EXPECT_LT((body.p_O - last.p_O).norm(), 1e-12);
  const Eigen::Quaterniond turn = body.q_OB * last.q_OB.conjugate();
  EXPECT_NEAR(turn.z(), 0.0, 1e-12) << "what is left is roll and pitch";
  EXPECT_GT(turn.vec().norm(), 0.05);
  EXPECT_LT((T_OW.q_OW * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  const Eigen::Matrix3d added = body.pose_covariance.topLeftCorner<3, 3>();
  EXPECT_LT((added - last.pose_covariance.topLeftCorner<3, 3>()).norm(), 1e-12);
  EXPECT_NEAR(body.pose_covariance(5, 5), last.pose_covariance(5, 5), 1e-12);
}

TEST(PlaceWorld, KeepsItsYawIfTheBodyHangsUpsideDown) {
  StampedPose start;
  start.q_WI = so3::exp({M_PI, 0.0, 0.0});
  const WorldInOdom T_OW = placeWorld(start, {});
  EXPECT_TRUE(T_OW.q_OW.coeffs().allFinite());
  EXPECT_LT(so3::log(T_OW.q_OW).norm(), 1e-12);
}

}  // namespace
}  // namespace rio_t
