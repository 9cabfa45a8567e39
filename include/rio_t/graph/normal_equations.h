#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "rio_t/graph/window.h"

/// The linearised graph, and block elimination of it (docs/method.md, section 6).
namespace rio_t {

/// By rows, as Ceres writes Jacobians.
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Blocks in a row of a matrix, in the order of their columns.
using BlockRow = std::vector<std::pair<int, RowMatrix>>;

/// H delta = -b in the tangents of `blocks`, in their order.
struct NormalEquations {
  std::vector<const Block*> blocks;
  std::vector<RowMatrix> diagonal;        ///< H_ii
  std::vector<BlockRow> coupling;         ///< H_ij, j > i; absent if zero
  std::vector<Eigen::VectorXd> gradient;  ///< b_i = sum J'r
  double cost = 0.0;                      ///< half the sum of squares, after the loss

  /// Without any information.
  explicit NormalEquations(std::vector<const Block*> blocks = {});
  int indexOf(const Block& block) const;  ///< -1 if it is not among them
  /// Holds block i: clears its row and column but for the diagonal, so that its delta is zero.
  void hold(int i);
};

/// Linearises `terms` at the current values of the blocks. A block that is constant or not in `blocks` is not
/// solved for. Throws std::runtime_error if a cost function fails.
NormalEquations linearize(std::vector<const Block*> blocks, const std::vector<const Term*>& terms);
NormalEquations linearize(const Window& window);
/// NormalEquations::cost of the window, without derivatives.
double costOf(const Window& window);

/// Block Cholesky factor H = U'U in the order of the blocks: U_ii and W_ij = U_ii'^-1 H_ij after the blocks
/// before i are eliminated.
class Elimination {
 public:
  /// None if H is not positive definite. If only rounding made H indefinite, the smallest sufficient share is
  /// added to its diagonal. `damping` (Levenberg-Marquardt) raises the diagonal by this share.
  static std::optional<Elimination> of(const NormalEquations& system, double damping = 0.0);

  const std::vector<Eigen::VectorXd>& delta() const { return delta_; }
  /// delta' H delta: the squared length of the step in sigmas.
  double squaredLength() const { return squared_length_; }
  /// Joint covariance of some blocks, by their indices, in that order. Not for two threads: it keeps the last
  /// answer. A scan needs the same one for the result and for the prediction of the next scan.
  const Eigen::MatrixXd& covariance(const std::vector<int>& indices) const;
  /// Covariance of every block, and of every two that U connects: [i][j], j >= i.
  std::vector<std::map<int, Eigen::MatrixXd>> covariances() const;

 private:
  bool factorise(const NormalEquations& system, double raise);

  std::vector<RowMatrix> U_;
  std::vector<BlockRow> W_;
  std::vector<Eigen::VectorXd> delta_;
  double squared_length_ = 0.0;
  mutable std::vector<int> asked_;  ///< of the covariance: a cache, as the next
  mutable Eigen::MatrixXd answer_;
};

/// Information about some blocks after others are eliminated.
struct Information {
  Eigen::MatrixXd S;  ///< information
  Eigen::VectorXd s;  ///< gradient
};
/// Eliminates the first `count` blocks and returns the information about the others. Throws
/// std::runtime_error if the data do not determine the first ones.
Information eliminateFirst(const NormalEquations& system, int count);

/// J and r0 with J'J = S and J'r0 = s. S may be singular: a direction without information gives a row of
/// zeros.
struct SquareRoot {
  Eigen::MatrixXd J;
  Eigen::VectorXd r0;
};
SquareRoot squareRoot(const Information& information);

}  // namespace rio_t
