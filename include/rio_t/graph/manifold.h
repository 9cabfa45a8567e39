#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

namespace rio_t {

/// A point of the world in the axes of a node.
struct PointFromNode {
  Eigen::Vector3d p;        ///< [m]
  Eigen::Matrix3Xd J_node;  ///< derivative of p by the tangent of the node
  Eigen::Matrix3d J_point;  ///< derivative of p by the point in W
};

/// How a block of parameters changes: x [+] delta, with `size()` stored numbers and `tangent()` directions.
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

  /// Whether the block is a point of the world. A prior refers it to the axes of a node (PriorTerm).
  virtual bool isPoint() const { return false; }
  /// A point of the world as the node x sees it; none if the block has no pose.
  virtual std::optional<PointFromNode> see(const double* /*x*/, const double* /*point*/) const {
    return std::nullopt;
  }

 protected:
  Manifold(int size, std::vector<int> columns) : size_(size), columns_(std::move(columns)) {}

 private:
  int size_;                  // read-only after construction
  std::vector<int> columns_;  // read-only after construction
};

/// A plain vector of `size` numbers, such as a time offset or a point.
class VectorManifold : public Manifold {
 public:
  explicit VectorManifold(int size) : Manifold(size, allColumns(size)) {}
  void plus(const double* x, const double* delta, double* x_plus_delta) const override {
    for (int i = 0; i < size(); ++i) x_plus_delta[i] = x[i] + delta[i];
  }
  Eigen::VectorXd minus(const double* y, const double* x) const override {
    using Values = Eigen::Map<const Eigen::VectorXd>;
    return Values(y, size()) - Values(x, size());
  }
  Eigen::MatrixXd minusJacobian(const double*, const double*) const override {
    return Eigen::MatrixXd::Identity(size(), size());
  }

 private:
  static std::vector<int> allColumns(int size) {
    std::vector<int> columns(static_cast<std::size_t>(size));
    std::iota(columns.begin(), columns.end(), 0);
    return columns;
  }
};

/// A point of the world, in W.
class PointManifold final : public VectorManifold {
 public:
  PointManifold() : VectorManifold(3) {}
  bool isPoint() const override { return true; }
};

}  // namespace rio_t
