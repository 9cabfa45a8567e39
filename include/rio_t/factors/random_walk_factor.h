#pragma once

#include <ceres/cost_function.h>

#include <Eigen/Core>

namespace rio_t {

/// A block changes slowly: residual (x_k - x_k-1) / sigma, for each of its numbers. A batch uses it for the
/// offset (paper eq. 8-10) and the biases. Blocks: x_k-1, x_k.
class RandomWalkFactor final : public ceres::CostFunction {
 public:
  /// `sigmas`: standard deviations of the change.
  explicit RandomWalkFactor(const Eigen::VectorXd& sigmas) : weights_(sigmas.cwiseInverse()) {
    const int size = static_cast<int>(sigmas.size());
    set_num_residuals(size);
    *mutable_parameter_block_sizes() = {size, size};
  }
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    using Values = Eigen::Map<const Eigen::VectorXd>;
    const Eigen::Index size = weights_.size();
    Eigen::Map<Eigen::VectorXd>(residuals, size) =
        weights_.cwiseProduct(Values(parameters[1], size) - Values(parameters[0], size));
    if (jacobians == nullptr) return true;
    using Jacobian = Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;
    if (jacobians[0] != nullptr) Jacobian(jacobians[0], size, size) = (-weights_).asDiagonal();
    if (jacobians[1] != nullptr) Jacobian(jacobians[1], size, size) = weights_.asDiagonal();
    return true;
  }

 private:
  Eigen::VectorXd weights_;
};

}  // namespace rio_t
