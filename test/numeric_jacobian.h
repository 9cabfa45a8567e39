#pragma once

#include <ceres/cost_function.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "rio_t/factors/extrinsics_manifold.h"
#include "rio_t/factors/motion_manifold.h"
#include "rio_t/graph/manifold.h"

namespace rio_t {

inline std::shared_ptr<const Manifold> manifoldOf(std::size_t size) {
  if (size == StateBlock::kMotion) return std::make_shared<MotionManifold>();
  if (size == ExtrinsicsBlock::kSize) return std::make_shared<ExtrinsicsManifold>(EstimateExtrinsics::kPose);
  return std::make_shared<VectorManifold>(static_cast<int>(size));
}

/// The two blocks of a state.
inline std::vector<double> motionOf(const StateBlock& x) { return {x.data(), x.biases()}; }
inline std::vector<double> biasesOf(const StateBlock& x) {
  return {x.biases(), x.biases() + StateBlock::kBiases};
}

/// Compares the Jacobians of a factor with central differences on the manifold: blocks of 10 are motions,
/// blocks of 7 are extrinsics, both moved on their manifolds; other blocks add up. `tolerance` is
/// relative to the largest entry of the block's Jacobian.
inline void expectJacobiansCorrect(const ceres::CostFunction& cost, std::vector<std::vector<double>> blocks,
                                   double tolerance = 1e-6, double step = 1e-5) {
  const int rows = cost.num_residuals();
  std::vector<const double*> parameters;
  parameters.reserve(blocks.size());
  for (const auto& block : blocks) parameters.push_back(block.data());
  std::vector<Eigen::Matrix<double, -1, -1, Eigen::RowMajor>> analytic;
  std::vector<double*> jacobians;
  analytic.reserve(blocks.size());
  jacobians.reserve(blocks.size());
  for (const auto& block : blocks) analytic.emplace_back(rows, block.size());
  for (auto& J : analytic) jacobians.push_back(J.data());
  Eigen::VectorXd r(rows);
  ASSERT_TRUE(cost.Evaluate(parameters.data(), r.data(), jacobians.data()));

  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const std::shared_ptr<const Manifold> manifold = manifoldOf(blocks[b].size());
    const int tangent = manifold->tangent();
    Eigen::MatrixXd expected(rows, tangent);
    Eigen::MatrixXd actual(rows, tangent);
    const std::vector<double> at = blocks[b];
    for (int i = 0; i < tangent; ++i) {
      Eigen::VectorXd moved[2] = {Eigen::VectorXd(rows), Eigen::VectorXd(rows)};
      for (int side = 0; side < 2; ++side) {
        const double h = side == 0 ? -step : step;
        const Eigen::VectorXd delta = h * Eigen::VectorXd::Unit(tangent, i);
        manifold->plus(at.data(), delta.data(), blocks[b].data());
        ASSERT_TRUE(cost.Evaluate(parameters.data(), moved[side].data(), nullptr));
      }
      blocks[b] = at;
      parameters[b] = blocks[b].data();
      expected.col(i) = (moved[1] - moved[0]) / (2.0 * step);
      actual.col(i) = analytic[b].col(manifold->columns()[static_cast<std::size_t>(i)]);
    }
    const double scale = std::max(1.0, expected.cwiseAbs().maxCoeff());
    EXPECT_LT((actual - expected).cwiseAbs().maxCoeff() / scale, tolerance) << "block " << b << "\nanalytic\n"
                                                                            << actual << "\nnumeric\n"
                                                                            << expected;
  }
}

}  // namespace rio_t
