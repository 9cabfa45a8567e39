#pragma once

#include <map>
#include <optional>
#include <vector>

#include "rio_t/graph/linear_system.h"

/// Block elimination of the linearised graph by QR (docs/method.md, section 6.3).
namespace rio_t {

/// The factor R of J = Q R, block by block in their order.
class Elimination {
 public:
  /// None if the rows do not determine every block.
  static std::optional<Elimination> of(const LinearSystem& system);

  const std::vector<Eigen::VectorXd>& delta() const { return delta_; }
  /// |R delta|^2: the squared length of the step in sigmas.
  double squaredLength() const { return squared_length_; }
  /// Joint covariance of some blocks, by their indices, in that order.
  Eigen::MatrixXd covariance(const std::vector<int>& indices) const;
  /// Covariance of every block, and of every two that R connects: [i][j], j >= i.
  std::vector<std::map<int, Eigen::MatrixXd>> covariances() const;

 private:
  /// The rows of each block: R_ii, then R_ij for the later blocks j that they depend on, then the right side
  /// z. Unused rows and columns of zeros may follow.
  std::vector<LinearRows> R_;
  std::vector<Eigen::Index> tangents_;
  std::vector<Eigen::VectorXd> delta_;
  double squared_length_ = 0.0;
};

/// Rows J delta + r0, as a prior holds them.
struct SquareRoot {
  Eigen::MatrixXd J;
  Eigen::VectorXd r0;
};
/// Eliminates the first `count` blocks and returns the rows that remain, about the other blocks. Throws
/// std::runtime_error if the rows do not determine the first ones.
SquareRoot eliminateFirst(const LinearSystem& system, int count);
/// Returns rows about x' = x + w, as many as x has numbers. w is a random walk with these variances (or 0).
SquareRoot widened(const SquareRoot& known, const Eigen::VectorXd& variances);

}  // namespace rio_t
