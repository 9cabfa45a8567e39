#pragma once

#include <Eigen/Core>
#include <vector>

#include "rio_t/graph/window.h"

namespace rio_t {

/// By rows, as Ceres writes Jacobians.
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Rows J delta + r of the linearised graph, whitened and after the loss.
struct LinearRows {
  std::vector<int> blocks;  ///< that they depend on, ascending
  RowMatrix Jr;             ///< the tangents of `blocks`, one after the other, and r in the last column
};

/// The linearised graph: the least squares of all rows, in the tangents of `blocks`. It keeps the rows
/// instead of the normal equations J'J, for precision. Nothing observes position and heading, so their sigmas
/// may be a billion times those of their changes in an IMU term. A double cannot hold the squares of both.
struct LinearSystem {
  std::vector<const Block*> blocks;
  std::vector<Eigen::Index> tangents;  ///< dimension of each block
  std::vector<LinearRows> rows;
  std::vector<bool> is_held;  ///< blocks that are not solved for and appear in no row
  double cost = 0.0;          ///< half the sum of squares, after the loss

  int indexOf(const Block& block) const;  ///< -1 if it is not among them
  Eigen::Index tangent(int i) const { return tangents[static_cast<std::size_t>(i)]; }
  Eigen::VectorXd gradient(int i) const;  ///< J'r of block i
  void hold(int i);                       ///< takes block i out of all rows
};

/// Linearises `terms` at the current values of the blocks. A block that is constant is held; one that is not
/// in `blocks` is not solved for. Throws std::runtime_error if a cost function fails.
LinearSystem linearize(std::vector<const Block*> blocks, const std::vector<const Term*>& terms);
LinearSystem linearize(const Window& window);
/// LinearSystem::cost of the window, without derivatives.
double costOf(const Window& window);

}  // namespace rio_t
