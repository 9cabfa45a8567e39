#pragma once

#include <ceres/version.h>

#include "rio_t/graph/manifold.h"

// Only this file knows the version of Ceres: manifolds since 2.1, else local parameterizations (Noetic).
#define RIO_T_CERES_HAS_MANIFOLD \
  (CERES_VERSION_MAJOR > 2 || (CERES_VERSION_MAJOR == 2 && CERES_VERSION_MINOR >= 1))

#if RIO_T_CERES_HAS_MANIFOLD
#include <ceres/manifold.h>
#else
#include <ceres/local_parameterization.h>
#endif

namespace rio_t {

#if RIO_T_CERES_HAS_MANIFOLD
using CeresManifoldBase = ceres::Manifold;
#else
using CeresManifoldBase = ceres::LocalParameterization;
#endif

/// A Manifold as Ceres wants it. `manifold` must outlive it.
class CeresManifold final : public CeresManifoldBase {
 public:
  explicit CeresManifold(const rio_t::Manifold& manifold) : manifold_(manifold) {}

  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    manifold_.plus(x, delta, x_plus_delta);
    return true;
  }
#if RIO_T_CERES_HAS_MANIFOLD
  int AmbientSize() const override { return manifold_.size(); }
  int TangentSize() const override { return manifold_.tangent(); }
  bool PlusJacobian(const double* /*x*/, double* jacobian) const override { return select(jacobian, false); }
  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    Eigen::Map<Eigen::VectorXd>(y_minus_x, TangentSize()) = manifold_.minus(y, x);
    return true;
  }
  bool MinusJacobian(const double* /*x*/, double* jacobian) const override { return select(jacobian, true); }
#else
  int GlobalSize() const override { return manifold_.size(); }
  int LocalSize() const override { return manifold_.tangent(); }
  bool ComputeJacobian(const double* /*x*/, double* jacobian) const override {
    return select(jacobian, false);
  }
#endif

 private:
  /// The stored columns that carry the tangent, as a row-major matrix of size x tangent, or its transpose.
  bool select(double* jacobian, bool transposed) const {
    const int rows = transposed ? manifold_.tangent() : manifold_.size();
    const int columns = transposed ? manifold_.size() : manifold_.tangent();
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> J(jacobian, rows,
                                                                                         columns);
    J.setZero();
    for (int i = 0; i < manifold_.tangent(); ++i) {
      const int column = manifold_.columns()[i];
      (transposed ? J(i, column) : J(column, i)) = 1.0;
    }
    return true;
  }

  const rio_t::Manifold& manifold_;
};

}  // namespace rio_t
