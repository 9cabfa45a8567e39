#pragma once

#include <Eigen/Core>
#include <vector>

namespace rio_t {

/// How a block of parameters moves: x [+] delta, with `size()` stored numbers and `tangent()` directions.
///
/// A cost function writes the derivative with respect to direction i into the stored column `columns()[i]`,
/// and zero into the other columns. So no factor needs the derivatives of a quaternion.
class Manifold {
 public:
  virtual ~Manifold() = default;
  int size() const { return size_; }
  int tangent() const { return static_cast<int>(columns_.size()); }
  const std::vector<int>& columns() const { return columns_; }

  virtual void plus(const double* x, const double* delta, double* x_plus_delta) const = 0;
  /// y [-] x: the delta that takes x to y.
  virtual Eigen::VectorXd minus(const double* y, const double* x) const = 0;
  /// Derivative of y [-] x with respect to the tangent at y.
  virtual Eigen::MatrixXd minusJacobian(const double* y, const double* x) const = 0;

 protected:
  Manifold(int size, std::vector<int> columns) : size_(size), columns_(std::move(columns)) {}

 private:
  int size_;                  // read-only after construction
  std::vector<int> columns_;  // read-only after construction
};

/// One number that adds up, such as a time offset.
class ScalarManifold final : public Manifold {
 public:
  ScalarManifold() : Manifold(1, {0}) {}
  void plus(const double* x, const double* delta, double* x_plus_delta) const override {
    *x_plus_delta = *x + *delta;
  }
  Eigen::VectorXd minus(const double* y, const double* x) const override {
    return Eigen::VectorXd::Constant(1, *y - *x);
  }
  Eigen::MatrixXd minusJacobian(const double*, const double*) const override {
    return Eigen::MatrixXd::Identity(1, 1);
  }
};

}  // namespace rio_t
