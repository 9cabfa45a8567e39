#pragma once

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "noise.h"
#include "rio_t/graph/window.h"

namespace rio_t {

/// Residual sum of A_i x_i - b, with made-up A_i and b.
class LinearCost final : public ceres::CostFunction {
 public:
  LinearCost(int rows, const std::vector<int>& sizes, int seed) : b_(rows) {
    set_num_residuals(rows);
    *mutable_parameter_block_sizes() = std::vector<std::int32_t>(sizes.begin(), sizes.end());
    for (int i = 0; i < rows; ++i) b_(i) = wave(seed + 31 * i);
    for (const int size : sizes) {
      Eigen::Matrix<double, -1, -1, Eigen::RowMajor> A(rows, size);
      for (int i = 0; i < A.size(); ++i) A(i) = wave(seed = seed + 7 + i);
      A_.push_back(A);
    }
  }
  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    Eigen::Map<Eigen::VectorXd> r(residuals, num_residuals());
    r = -b_;
    for (std::size_t i = 0; i < A_.size(); ++i) {
      r += A_[i] * Eigen::Map<const Eigen::VectorXd>(x[i], A_[i].cols());
      if (jacobians == nullptr || jacobians[i] == nullptr) continue;
      std::copy(A_[i].data(), A_[i].data() + A_[i].size(), jacobians[i]);
    }
    return true;
  }

 private:
  Eigen::VectorXd b_;
  std::vector<Eigen::Matrix<double, -1, -1, Eigen::RowMajor>> A_;
};

/// Nodes of 3 numbers, calibration of 2, terms between neighbours and on the calibration. Linear.
struct LinearWindow {
  explicit LinearWindow(int count) {
    calibration = window.addCalibration(std::make_shared<VectorManifold>(2), Eigen::VectorXd::Zero(2));
    for (int k = 0; k < count; ++k) {
      nodes.push_back(&window.addNode(Time::fromSeconds(k), three, Eigen::VectorXd::Zero(3)));
      window.add(std::make_unique<LinearCost>(5, std::vector<int>{3, 2}, 100 * k),
                 {nodes.back(), calibration.get()});
      if (k > 0)
        window.add(std::make_unique<LinearCost>(4, std::vector<int>{3, 3}, 100 * k + 50),
                   {nodes[k - 1], nodes[k]});
    }
  }
  std::shared_ptr<const Manifold> three = std::make_shared<VectorManifold>(3);
  Window window;
  std::vector<Block*> nodes;
  std::shared_ptr<Block> calibration;
};

}  // namespace rio_t
