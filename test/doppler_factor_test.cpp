// The likelihood of a scan's points as a factor: Jacobians against numeric ones, and against a row for each
// point.
#include "rio_t/factors/doppler_factor.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "factor_setup.h"
#include "noise.h"
#include "numeric_jacobian.h"
#include "synthetic_motion.h"

namespace rio_t {
namespace {

/// A scan of `count` points, taken at 1 s, for a state at 0.98 s, and a factor for it.
struct DopplerScan {
  static constexpr double kPlacedAt = 0.02;  // [s] the t_O around which the motion is linear

  DopplerScan(std::size_t count, const PointVariances& noise) : imu(motion.imu(0.5, 1.6, 400.0)) {
    x = moved(motion.state(0.98), 0.02);
    const RadarVelocityMeasurement mounted = measurement(motion.time(1.0));
    z.stamp = mounted.stamp;
    z.offset_gain = 1.0;
    z.linear_from_t_O = std::make_shared<const double>(kPlacedAt);
    const Eigen::Vector3d v_R = motion.radarVelocity(1.0 - kPlacedAt, mounting().R_RI(), mounting().l_I);
    Noise draw;
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector3d u = (Eigen::Vector3d(0.0, 1.0, 0.0) + 0.5 * draw.vector()).normalized();
      const double doppler = -u.dot(v_R) + 0.05 * draw();
      directions.push_back({u, doppler, i});
    }
    z.points = std::make_shared<DopplerLikelihood>(directions, v_R, noise);
  }

  DopplerFactor factor() const { return {z, motion.time(0.98), imuModel(imu)}; }
  PredictedVelocity predicted(const StateBlock& at, double t_O) const {
    const double* blocks[] = {at.data(), at.biases(), &t_O, storedMounting().data()};
    return RadarVelocityModel(z, motion.time(0.98), imuModel(imu)).at(blocks, true);
  }
  /// Half the sum of the squares of a factor that remembers nothing.
  double cost(const StateBlock& at, double t_O, const std::vector<double>& T_IR = storedMounting()) const {
    return cost(factor(), at, t_O, T_IR);
  }
  static double cost(const DopplerFactor& factor, const StateBlock& at, double t_O,
                     const std::vector<double>& T_IR = storedMounting()) {
    const double* blocks[] = {at.data(), at.biases(), &t_O, T_IR.data()};
    Eigen::Vector4d r;
    EXPECT_TRUE(factor.Evaluate(blocks, r.data(), nullptr));
    return 0.5 * r.squaredNorm();
  }
  /// Residuals and Jacobian by state, t_O and extrinsics, as stored.
  static constexpr int kExtrinsics = StateBlock::kSize + 1;
  static constexpr int kStored = kExtrinsics + ExtrinsicsBlock::kSize;
  using Jacobian = Eigen::Matrix<double, 4, kStored>;
  Eigen::Vector4d linearized(const StateBlock& at, double t_O, Jacobian& J) const {
    const double* blocks[] = {at.data(), at.biases(), &t_O, storedMounting().data()};
    MotionJacobian<4> J_motion;
    BiasJacobian<4> J_biases;
    ExtrinsicsJacobian<4> J_extrinsics;
    Eigen::Vector4d J_t, r;
    double* jacobians[] = {J_motion.data(), J_biases.data(), J_t.data(), J_extrinsics.data()};
    EXPECT_TRUE(factor().Evaluate(blocks, r.data(), jacobians));
    J << J_motion, J_biases, J_t, J_extrinsics;
    return r;
  }

  SyntheticMotion motion;
  ImuBuffer imu;
  StateBlock x;
  std::vector<RadarDirection> directions;
  DopplerMeasurement z;
};

/// 1.7 and 2.9 degrees, without and with a bin.
PointVariances dopplerNoise(double step) {
  PointVariances noise;
  noise.doppler = 0.03 * 0.03;
  noise.azimuth = 0.03 * 0.03;
  noise.elevation = 0.05 * 0.05;
  noise.quantization = step * step / 12.0;
  return noise;
}
/// Dopplers whose residuals are linear.
PointVariances gaussian() {
  PointVariances noise;
  noise.doppler = 0.03 * 0.03;
  noise.outlier_density = 0.0;
  return noise;
}

using RowJacobian = Eigen::Matrix<double, 1, DopplerScan::kStored>;

TEST(DopplerFactor, SaysTheSameAsARowForEachPoint) {
  for (const double step : {0.0, 0.25}) {
    for (const std::size_t count : {1U, 2U, 3U, 40U}) {
      const DopplerScan scan(count, dopplerNoise(step));
      const PredictedVelocity predicted = scan.predicted(scan.x, DopplerScan::kPlacedAt);
      double cost = 0.0;
      DopplerScan::Jacobian J;
      Eigen::VectorXd b = Eigen::VectorXd::Zero(DopplerScan::kStored);
      Eigen::MatrixXd H = Eigen::MatrixXd::Zero(DopplerScan::kStored, DopplerScan::kStored);
      for (std::size_t i = 0; i < count; ++i) {
        Eigen::Vector3d derivative;
        const double r = scan.z.points->residual(i, predicted.v_R, derivative);
        RowJacobian row;
        row << derivative.transpose() * predicted.J_motion, derivative.transpose() * predicted.J_biases,
            derivative.dot(predicted.dv_dt_O), derivative.transpose() * predicted.J_extrinsics;
        cost += 0.5 * r * r;
        b += r * row.transpose();
        H += row.transpose() * row;
      }
      const Eigen::Vector4d r = scan.linearized(scan.x, DopplerScan::kPlacedAt, J);
      EXPECT_GT(cost, 0.0);
      EXPECT_NEAR(0.5 * r.squaredNorm(), cost, 1e-10 * cost) << count;
      EXPECT_LT((J.transpose() * r - b).norm(), 1e-8 * b.norm()) << count;
      EXPECT_LT((J.transpose() * J - H).norm(), 1e-8 * H.norm()) << count;
    }
  }
}

TEST(DopplerFactor, ItsGradientIsThatOfTheCost) {
  for (const double step : {0.0, 0.25}) {
    for (const std::size_t count : {1U, 2U, 3U, 40U}) {
      const DopplerScan scan(count, dopplerNoise(step));
      constexpr double t_O = DopplerScan::kPlacedAt;
      DopplerScan::Jacobian J;
      const Eigen::Vector4d r = scan.linearized(scan.x, t_O, J);
      const Eigen::VectorXd stored = J.transpose() * r;
      constexpr double h = 1e-6;
      for (int i = 0; i < StateBlock::kTangent; ++i) {
        double costs[2];
        for (const int side : {0, 1}) {
          StateTangent delta = StateTangent::Zero();
          delta(i) = side == 0 ? -h : h;
          StateBlock x;
          boxplus(scan.x.data(), delta.data(), x.data());
          costs[side] = scan.cost(x, t_O);
        }
        EXPECT_NEAR(stored[i < 3 ? i : i + 1], (costs[1] - costs[0]) / (2.0 * h), 1e-5 * stored.norm())
            << count << " points, step " << step << ", tangent " << i;
      }
      EXPECT_NEAR(stored[StateBlock::kSize],
                  (scan.cost(scan.x, t_O + h) - scan.cost(scan.x, t_O - h)) / (2.0 * h), 1e-5 * stored.norm())
          << count << " points, step " << step;
      const ExtrinsicsManifold manifold(EstimateExtrinsics::kPose);
      for (int i = 0; i < manifold.tangent(); ++i) {
        double costs[2];
        for (const int side : {0, 1}) {
          const Eigen::VectorXd delta = (side == 0 ? -h : h) * Eigen::VectorXd::Unit(6, i);
          std::vector<double> T_IR = storedMounting();
          manifold.plus(T_IR.data(), delta.data(), T_IR.data());
          costs[side] = scan.cost(scan.x, t_O, T_IR);
        }
        EXPECT_NEAR(stored[DopplerScan::kExtrinsics + manifold.columns()[static_cast<std::size_t>(i)]],
                    (costs[1] - costs[0]) / (2.0 * h), 1e-5 * stored.norm())
            << count << " points, step " << step << ", extrinsics " << i;
      }
    }
  }
}

TEST(DopplerFactor, ARememberedExpansionIsAsGoodAsThePoints) {
  for (const double step : {0.0, 0.25}) {
    const DopplerScan scan(40, dopplerNoise(step));
    const DopplerFactor factor = scan.factor();
    StateBlock x = scan.x;
    for (int i = 0; i < 200; ++i) {
      // A few mm/s each time.
      StateTangent delta = StateTangent::Zero();
      for (int k = 0; k < 3; ++k) delta(StateBlock::kV + k) = 0.001 * std::sin(1.0 + 0.1 * i + 2.0 * k);
      boxplus(x.data(), delta.data(), x.data());
      const double cost = scan.cost(x, DopplerScan::kPlacedAt);
      EXPECT_NEAR(DopplerScan::cost(factor, x, DopplerScan::kPlacedAt), cost, 0.02) << i << ", cost " << cost;
    }
  }
}

TEST(DopplerFactor, AnErrorThatThePointsShareLowersTheInformation) {
  for (const std::size_t count : {1U, 2U, 3U, 40U}) {
    DopplerScan scan(count, gaussian());
    const PredictedVelocity predicted = scan.predicted(scan.x, DopplerScan::kPlacedAt);
    const Eigen::Matrix3d A = scan.z.points->at(predicted.v_R).information;
    const Eigen::Vector3d D(1.6e-3, 4.0e-4, 2.5e-3);
    scan.z.shared_variances = D;
    // (A^-1 + D)^-1, where A may be singular.
    const Eigen::Matrix3d expected =
        A * (Eigen::Matrix3d::Identity() + Eigen::Matrix3d(D.asDiagonal()) * A).inverse();
    Eigen::Matrix<double, 3, DopplerScan::kStored> J_v;
    J_v << predicted.J_motion, predicted.J_biases, predicted.dv_dt_O, predicted.J_extrinsics;
    DopplerScan::Jacobian J;
    scan.linearized(scan.x, DopplerScan::kPlacedAt, J);
    const auto H = (J_v.transpose() * expected * J_v).eval();
    EXPECT_LT((J.transpose() * J - H).norm(), 1e-7 * H.norm()) << count;
    if (count >= 3) {
      const Eigen::Matrix3d D_matrix = D.asDiagonal();
      EXPECT_LT((expected - (A.inverse() + D_matrix).inverse()).norm(), 1e-8 * expected.norm());
    }
  }
}

TEST(DopplerFactor, TheSharedErrorIsTheOneThatCostsLeast) {
  for (const double step : {0.0, 0.25}) {
    DopplerScan scan(40, dopplerNoise(step));
    scan.x.v_W() += Eigen::Vector3d(0.08, -0.08, 0.05);
    const double alone = scan.cost(scan.x, DopplerScan::kPlacedAt);
    const Eigen::Vector3d D(1.6e-3, 4.0e-4, 2.5e-3);
    scan.z.shared_variances = D;
    const double shared = scan.cost(scan.x, DopplerScan::kPlacedAt);
    const Eigen::Vector3d v_R = scan.predicted(scan.x, DopplerScan::kPlacedAt).v_R;
    double least = alone;
    for (double x = -0.15; x < 0.15; x += 0.005)
      for (double y = -0.1; y < 0.1; y += 0.005)
        for (double z = -0.2; z < 0.2; z += 0.005) {
          const Eigen::Vector3d e(x, y, z);
          const double own = 0.5 * (e.array().square() / D.array()).sum();
          if (own < least) least = std::min(least, own + scan.z.points->at(v_R + e).value);
        }
    EXPECT_LT(shared, 0.7 * alone);
    EXPECT_NEAR(shared, least, 0.02 * alone) << "alone " << alone;
  }
}

TEST(DopplerFactor, BeyondTheThresholdTheCostOfTheSharedErrorIsLinear) {
  // Two points along each axis: the information is the same in all directions.
  DopplerScan scan(1, gaussian());
  const Eigen::Vector3d v_R = scan.predicted(scan.x, DopplerScan::kPlacedAt).v_R;
  const double sigma = 0.03, shared_sigma = 0.04, threshold = 1.5;
  const double a = 2.0 / (sigma * sigma + 1e-6);  // information [s^2/m^2]
  for (const double distance : {0.03, 0.2, 0.6}) {
    const Eigen::Vector3d d = distance * Eigen::Vector3d(0.6, -0.64, 0.48);
    std::vector<RadarDirection> points;
    for (int i = 0; i < 6; ++i) {
      const Eigen::Vector3d u = (i % 2 == 0 ? 1.0 : -1.0) * Eigen::Vector3d::Unit(i / 2);
      points.push_back({u, -u.dot(v_R + d), static_cast<std::size_t>(i)});
    }
    scan.z.points = std::make_shared<DopplerLikelihood>(points, v_R, gaussian());
    scan.z.shared_variances.setConstant(shared_sigma * shared_sigma);
    scan.z.huber_threshold = threshold;
    // The error that costs least: quadratic, or with the slope of the loss.
    double error = distance * a / (a + 1.0 / (shared_sigma * shared_sigma));
    double expected = 0.5 * distance * distance / (1.0 / a + shared_sigma * shared_sigma);
    double slope = distance / (1.0 / a + shared_sigma * shared_sigma);
    if (error > threshold * shared_sigma) {
      slope = threshold / shared_sigma;
      error = distance - slope / a;
      expected = 0.5 * a * (distance - error) * (distance - error) + threshold * error / shared_sigma -
                 0.5 * threshold * threshold;
    }
    DopplerScan::Jacobian J;
    const Eigen::Vector4d r = scan.linearized(scan.x, DopplerScan::kPlacedAt, J);
    EXPECT_NEAR(0.5 * r.squaredNorm(), expected, 0.01 * expected) << distance;
    // With respect to the velocity of the state: the motion only turns it.
    const Eigen::Vector3d by_v = (J.transpose() * r).segment<3>(StateBlock::kVStored);
    EXPECT_NEAR(by_v.norm(), slope, 0.01 * slope) << distance;
  }
}

TEST(DopplerFactor, WithoutAGainTheScanDoesNotTellTheOffset) {
  DopplerScan scan(40, dopplerNoise(0.25));
  scan.z.offset_gain = 0.0;
  DopplerScan::Jacobian J;
  scan.linearized(scan.x, 0.1, J);
  EXPECT_EQ(J.col(StateBlock::kSize), Eigen::Vector4d::Zero());
  EXPECT_EQ(scan.cost(scan.x, 0.1), scan.cost(scan.x, -0.1));
}

}  // namespace
}  // namespace rio_t
