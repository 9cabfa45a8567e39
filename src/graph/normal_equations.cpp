#include "rio_t/graph/normal_equations.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <type_traits>
#include <unordered_map>
#include <utility>

namespace rio_t {
namespace {

/// Smallest diagonal of a scaled Cholesky factor that still says something, as a square root of 1e-12.
constexpr double kWellDetermined = 1e-6;
/// After a long way hardly anything is known of the position: 1/(200 m)^2 beside the 1/(4 um)^2 of an IMU
/// factor over 5 ms is within the rounding of a double, and an elimination may come out indefinite. Then the
/// diagonal is lifted by as little as it takes.
constexpr double kSmallestLift = 1e-15;
constexpr double kLargestLift = 1e-9;

/// Calls part(first, width) for parts of the columns, with widths that the compiler knows: 15 of a state, 6
/// and 3 of a mounting, 1 of an offset.
template <typename Part>
void inParts(Eigen::Index columns, const Part& part) {
  Eigen::Index first = 0;
  const auto take = [&](auto width) {
    for (; columns - first >= width; first += width) part(first, width);
  };
  take(std::integral_constant<int, 15>());
  take(std::integral_constant<int, 6>());
  take(std::integral_constant<int, 3>());
  take(std::integral_constant<int, 1>());
}

/// The symmetric product of a state is needed on one side of its diagonal only. Two widths that the compiler
/// knows are faster than the exact one.
constexpr int kState = 15, kHalf = 8;

/// sum += sign A' x.
void addProduct(const RowMatrix& A, const Eigen::VectorXd& x, double sign, Eigen::VectorXd& sum) {
  for (Eigen::Index row = 0; row < A.rows(); ++row)
    for (Eigen::Index i = 0; i < A.cols(); ++i) sum[i] += sign * x[row] * A.data()[row * A.cols() + i];
}

/// A column of A times N columns of B, over so many rows, times `sign`, added to `to`. `a` and `b` are their
/// numbers in the first row, and the rows of A and B have that many columns. The sums stay in registers.
template <int N>
void addColumnProduct(const double* a, Eigen::Index a_columns, const double* b, Eigen::Index b_columns,
                      Eigen::Index rows, double sign, double* to) {
  std::array<double, N> sums{};
  std::copy_n(to, N, sums.begin());
  for (; rows > 0; --rows, a += a_columns, b += b_columns) {
    const double factor = sign * *a;
    for (std::size_t j = 0; j < N; ++j) sums[j] += factor * b[j];
  }
  std::copy_n(sums.begin(), N, to);
}

template <int N>
void addColumnProduct(const RowMatrix& A, Eigen::Index i, const RowMatrix& B, Eigen::Index first, double sign,
                      RowMatrix& sum) {
  addColumnProduct<N>(&A(0, i), A.cols(), &B(0, first), B.cols(), A.rows(), sign, &sum(i, first));
}

/// sum += sign A' B. At these sizes Eigen's blocked product costs several times as much.
void addProduct(const RowMatrix& A, const RowMatrix& B, double sign, RowMatrix& sum) {
  if (sum.size() == 0) sum.setZero(A.cols(), B.cols());
  inParts(B.cols(), [&](Eigen::Index first, auto width) {
    for (Eigen::Index i = 0; i < A.cols(); ++i) addColumnProduct<width>(A, i, B, first, sign, sum);
  });
}

/// sum -= A' A, of which the upper triangle counts.
void subtractSquare(const RowMatrix& A, RowMatrix& sum) {
  if (A.cols() != kState) return addProduct(A, A, -1.0, sum);
  for (Eigen::Index i = 0; i < kState - kHalf; ++i) addColumnProduct<kState>(A, i, A, 0, -1.0, sum);
  for (Eigen::Index i = kState - kHalf; i < kState; ++i)
    addColumnProduct<kHalf>(A, i, A, kState - kHalf, -1.0, sum);
}

/// N columns of row i of W, from column `first` on: W_i <- (W_i - sum of U_ki W_k over k < i) / U_ii.
template <int N>
void substituteRow(const RowMatrix& U, Eigen::Index i, Eigen::Index first, double inverse, double* W,
                   Eigen::Index columns) {
  double* const to = W + i * columns + first;
  std::array<double, N> sums{};
  std::copy_n(to, N, sums.begin());
  const double* from = W + first;
  for (Eigen::Index k = 0; k < i; ++k, from += columns) {
    const double factor = U(k, i);
    for (std::size_t j = 0; j < N; ++j) sums[j] -= factor * from[j];
  }
  for (std::size_t j = 0; j < N; ++j) to[j] = sums[j] * inverse;
}

/// W <- U'^-1 W, for the upper triangle of U.
template <typename Matrix>
void forwardSubstitute(const RowMatrix& U, Matrix& W) {
  for (Eigen::Index i = 0; i < U.rows(); ++i)
    inParts(W.cols(), [&, inverse = 1.0 / U(i, i)](Eigen::Index first, auto width) {
      substituteRow<width>(U, i, first, inverse, W.data(), W.cols());
    });
}

/// S <- its Cholesky factor U, S = U'U, in the upper triangle; what is below means nothing. False if S is not
/// positive definite.
bool cholesky(RowMatrix& S) {
  for (Eigen::Index i = 0; i < S.rows(); ++i) {
    double pivot = S(i, i);
    for (Eigen::Index k = 0; k < i; ++k) pivot -= S(k, i) * S(k, i);
    if (!(pivot > 0.0)) return false;
    const auto substitute = [&, inverse = 1.0 / std::sqrt(pivot)](Eigen::Index first, auto width) {
      substituteRow<width>(S, i, first, inverse, S.data(), S.cols());
    };
    if (S.rows() == kState && i >= kState - kHalf) {
      substitute(kState - kHalf, std::integral_constant<int, kHalf>());
    } else {
      inParts(S.cols(), substitute);
    }
  }
  return true;
}

/// The derivatives of a term with respect to the tangent of a block. Most of those of an IMU factor are zero,
/// so each column is known by the rows from its first number that is not zero to its last one.
class Jacobian {
 public:
  /// Memory for a cost function to write to.
  double* start(Eigen::Index rows, const Manifold& manifold) {
    rows_ = rows;
    columns_ = manifold.tangent();
    const auto size = static_cast<std::size_t>(rows * manifold.size());
    if (numbers_.size() < size) numbers_.resize(size);
    return numbers_.data();
  }
  /// Moves the columns that carry the tangent together, times `root`.
  void finish(const Manifold& manifold, double root) {
    double* to = numbers_.data();
    const double* from = to;
    for (Eigen::Index row = 0; row < rows_; ++row, from += manifold.size())
      for (const int column : manifold.columns()) *to++ = root * from[column];
    ranges_.clear();
    for (Eigen::Index i = 0; i < columns_; ++i) {
      Range range{0, rows_};
      while (range.first < range.end && at(range.first, i) == 0.0) ++range.first;
      while (range.first < range.end && at(range.end - 1, i) == 0.0) --range.end;
      ranges_.push_back(range.first < range.end ? range : Range{0, 0});
    }
  }

  /// sum += this' r.
  void addProduct(const Eigen::VectorXd& r, Eigen::VectorXd& sum) const {
    for (Eigen::Index i = 0; i < columns_; ++i)
      for (Eigen::Index row = ranges_[i].first; row < ranges_[i].end; ++row) sum[i] += at(row, i) * r[row];
  }
  /// sum += this' B.
  void addProduct(const Jacobian& B, RowMatrix& sum) const {
    if (sum.size() == 0) sum.setZero(columns_, B.columns_);
    inParts(B.columns_, [&](Eigen::Index first, auto width) {
      for (Eigen::Index i = 0; i < columns_; ++i) addColumnProduct<width>(i, B, first, &sum(i, first));
    });
  }
  /// sum += this' this, of which the lower triangle counts.
  void addSquare(RowMatrix& sum) const {
    if (columns_ != kState) return addProduct(*this, sum);
    for (Eigen::Index i = 0; i < kHalf; ++i) addColumnProduct<kHalf>(i, *this, 0, &sum(i, 0));
    for (Eigen::Index i = kHalf; i < kState; ++i) addColumnProduct<kState>(i, *this, 0, &sum(i, 0));
  }

 private:
  struct Range {
    Eigen::Index first, end;
  };
  const double& at(Eigen::Index row, Eigen::Index i) const { return numbers_[row * columns_ + i]; }
  template <int N>
  void addColumnProduct(Eigen::Index i, const Jacobian& B, Eigen::Index first, double* to) const {
    const auto [row, end] = ranges_[i];
    rio_t::addColumnProduct<N>(&at(row, i), columns_, B.numbers_.data() + row * B.columns_ + first,
                               B.columns_, end - row, 1.0, to);
  }

  Eigen::Index rows_ = 0, columns_ = 0;
  std::vector<double> numbers_;  // by rows
  std::vector<Range> ranges_;    // by columns
};

/// Residual and derivatives of a term with respect to the tangents of its blocks, after the loss. Keeps its
/// memory from term to term.
class Linearized {
 public:
  void evaluate(const Term& term) {
    const Eigen::Index rows = term.cost->num_residuals();
    if (J_.size() < term.blocks.size()) J_.resize(term.blocks.size());
    jacobians_.clear();
    for (std::size_t i = 0; i < term.blocks.size(); ++i)
      jacobians_.push_back(term.blocks[i]->is_constant ? nullptr
                                                       : J_[i].start(rows, *term.blocks[i]->manifold));
    const double root = std::sqrt(evaluate(term, jacobians_.data()));
    r_ *= root;
    for (std::size_t i = 0; i < term.blocks.size(); ++i)
      if (jacobians_[i] != nullptr) J_[i].finish(*term.blocks[i]->manifold, root);
  }
  /// Without derivatives.
  double costOf(const Term& term) {
    evaluate(term, nullptr);
    return cost_;
  }
  const Eigen::VectorXd& r() const { return r_; }
  /// Of a block that is not constant.
  const Jacobian& J(std::size_t i) const { return J_[i]; }
  double cost() const { return cost_; }

 private:
  /// Sets residual and cost; returns the derivative of the loss.
  double evaluate(const Term& term, double** jacobians) {
    r_.resize(term.cost->num_residuals());
    parameters_.clear();
    for (const Block* block : term.blocks) parameters_.push_back(block->x.data());
    if (!term.cost->Evaluate(parameters_.data(), r_.data(), jacobians))
      throw std::runtime_error("graph: a factor cannot be evaluated");
    double rho[3] = {r_.squaredNorm(), 1.0, 0.0};
    if (term.loss) term.loss->Evaluate(rho[0], rho);
    cost_ = 0.5 * rho[0];
    return rho[1];
  }

  Eigen::VectorXd r_;
  std::vector<const double*> parameters_;
  std::vector<double*> jacobians_;
  std::vector<Jacobian> J_;
  double cost_ = 0.0;
};

/// The block in column j, added if it is not there.
RowMatrix& blockAt(BlockRow& row, int j) {
  auto at = std::lower_bound(row.begin(), row.end(), j,
                             [](const auto& block, int column) { return block.first < column; });
  if (at == row.end() || at->first != j) at = row.emplace(at, j, RowMatrix());
  return at->second;
}

/// `indices` of the blocks of the term; -1: not solved for.
void addTo(NormalEquations& system, const Linearized& linear, const std::vector<int>& indices) {
  system.cost += linear.cost();
  for (std::size_t a = 0; a < indices.size(); ++a) {
    const int i = indices[a];
    if (i < 0) continue;
    linear.J(a).addSquare(system.diagonal[i]);
    linear.J(a).addProduct(linear.r(), system.gradient[i]);
    for (std::size_t b = 0; b < indices.size(); ++b)
      if (indices[b] > i) linear.J(a).addProduct(linear.J(b), blockAt(system.coupling[i], indices[b]));
  }
}

}  // namespace

NormalEquations::NormalEquations(std::vector<const Block*> blocks_in) : blocks(std::move(blocks_in)) {
  for (const Block* block : blocks) {
    const int tangent = block->manifold->tangent();
    diagonal.emplace_back(RowMatrix::Zero(tangent, tangent));
    gradient.emplace_back(Eigen::VectorXd::Zero(tangent));
  }
  coupling.resize(blocks.size());
}

int NormalEquations::indexOf(const Block& block) const {
  const auto found = std::find(blocks.rbegin(), blocks.rend(), &block);
  return static_cast<int>(blocks.rend() - found) - 1;
}

void NormalEquations::hold(int i) {
  for (int k = 0; k < i; ++k) {
    const auto is_held = [i](const auto& block) { return block.first == i; };
    coupling[k].erase(std::remove_if(coupling[k].begin(), coupling[k].end(), is_held), coupling[k].end());
  }
  coupling[i].clear();
  diagonal[i].setIdentity();
  gradient[i].setZero();
}

NormalEquations linearize(std::vector<const Block*> blocks, const std::vector<const Term*>& terms) {
  NormalEquations system(std::move(blocks));
  std::unordered_map<const Block*, int> index;
  for (std::size_t i = 0; i < system.blocks.size(); ++i) index[system.blocks[i]] = static_cast<int>(i);
  Linearized linear;
  std::vector<int> indices;
  for (const Term* term : terms) {
    linear.evaluate(*term);
    indices.clear();
    for (const Block* block : term->blocks) {
      const auto found = index.find(block);
      indices.push_back(found == index.end() || block->is_constant ? -1 : found->second);
    }
    addTo(system, linear, indices);
  }
  for (RowMatrix& H : system.diagonal)
    for (Eigen::Index i = 0; i < H.rows(); ++i)
      for (Eigen::Index j = 0; j < i; ++j) H(j, i) = H(i, j);
  for (std::size_t i = 0; i < system.blocks.size(); ++i)
    if (system.blocks[i]->is_constant) system.hold(static_cast<int>(i));
  return system;
}

NormalEquations linearize(const Window& window) {
  std::vector<const Block*> blocks;
  std::vector<const Term*> terms;
  for (const auto& block : window.blocks()) blocks.push_back(block.get());
  for (const auto& term : window.terms()) terms.push_back(term.get());
  return linearize(std::move(blocks), terms);
}

double costOf(const Window& window) {
  Linearized linear;
  double cost = 0.0;
  for (const auto& term : window.terms()) cost += linear.costOf(*term);
  return cost;
}

bool Elimination::factorise(const NormalEquations& system, double raise) {
  const std::size_t count = system.blocks.size();
  U_ = system.diagonal;
  W_ = system.coupling;
  delta_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    delta_[i] = -system.gradient[i];
    U_[i].diagonal() *= 1.0 + raise;
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (!cholesky(U_[i])) return false;
    forwardSubstitute(U_[i], delta_[i]);
    for (auto& [j, W] : W_[i]) {
      forwardSubstitute(U_[i], W);
      addProduct(W, delta_[i], -1.0, delta_[j]);
    }
    for (auto a = W_[i].begin(); a != W_[i].end(); ++a) {
      subtractSquare(a->second, U_[a->first]);
      for (auto b = std::next(a); b != W_[i].end(); ++b)
        addProduct(a->second, b->second, -1.0, blockAt(W_[a->first], b->first));
    }
  }
  squared_length_ = 0.0;
  for (std::size_t i = count; i-- > 0;) {
    for (const auto& [j, W] : W_[i]) delta_[i].noalias() -= W * delta_[j];
    U_[i].triangularView<Eigen::Upper>().solveInPlace(delta_[i]);
    squared_length_ -= delta_[i].dot(system.gradient[i]);
  }
  return true;
}

std::optional<Elimination> Elimination::of(const NormalEquations& system, double damping) {
  Elimination result;
  bool done = result.factorise(system, damping);
  for (double lift = kSmallestLift; !done && damping == 0.0 && lift <= kLargestLift; lift *= 10.0)
    done = result.factorise(system, lift);
  if (!done) return std::nullopt;
  return result;
}

const Eigen::MatrixXd& Elimination::covariance(const std::vector<int>& indices) const {
  if (std::exchange(asked_, indices) == indices) return answer_;
  Eigen::Index columns = 0;
  for (const int i : indices) columns += U_[i].rows();
  // Y = U'^-1 E, where E selects the blocks: their covariance is Y'Y.
  std::map<int, RowMatrix> Y;
  Eigen::Index first = 0;
  for (const int i : indices) {
    Y[i].setZero(U_[i].rows(), columns);
    Y[i].middleCols(first, U_[i].rows()).setIdentity();
    first += U_[i].rows();
  }
  RowMatrix result = RowMatrix::Zero(columns, columns);
  for (auto at = Y.begin(); at != Y.end(); ++at) {
    auto& [i, y] = *at;
    forwardSubstitute(U_[i], y);
    for (const auto& [j, W] : W_[i]) addProduct(W, y, -1.0, Y[j]);
    addProduct(y, y, 1.0, result);
  }
  return answer_ = result;
}

std::vector<std::map<int, Eigen::MatrixXd>> Elimination::covariances() const {
  std::vector<std::map<int, Eigen::MatrixXd>> P(U_.size());
  const auto at = [&](int a, int b) -> Eigen::MatrixXd {
    return a <= b ? P[a].at(b) : Eigen::MatrixXd(P[b].at(a).transpose());
  };
  for (std::size_t i = U_.size(); i-- > 0;) {
    const auto U = U_[i].triangularView<Eigen::Upper>();
    const Eigen::MatrixXd inverse = U.solve(Eigen::MatrixXd::Identity(U_[i].rows(), U_[i].rows()));
    P[i][static_cast<int>(i)] = inverse * inverse.transpose();
    // delta_i = G_i (...) - sum_j G_ij delta_j with G_ij = U_ii^-1 W_ij.
    std::map<int, Eigen::MatrixXd> G;
    for (const auto& [j, W] : W_[i]) G[j] = U.solve(W);
    for (const auto& [j, unused] : G) {
      Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(U_[i].rows(), U_[j].rows());
      for (const auto& [k, G_ik] : G) sum.noalias() -= G_ik * at(k, j);
      P[i][static_cast<int>(i)].noalias() -= sum * G[j].transpose();
      P[i][j] = std::move(sum);
    }
  }
  return P;
}

Information eliminateFirst(const NormalEquations& system, int count) {
  const int blocks = static_cast<int>(system.blocks.size());
  Eigen::Index rows = 0, left = 0;
  std::vector<Eigen::Index> first;
  for (int i = 0; i < blocks; ++i) {
    first.push_back(rows);
    rows += system.diagonal[i].rows();
    if (i < count) left = rows;
  }
  // The gradient is one more column; the last row says nothing.
  RowMatrix H = RowMatrix::Zero(rows + 1, rows + 1);
  for (int i = 0; i < blocks; ++i) {
    H.col(rows).segment(first[i], system.gradient[i].size()) = system.gradient[i];
    H.block(first[i], first[i], system.diagonal[i].rows(), system.diagonal[i].rows()) = system.diagonal[i];
    for (const auto& [j, part] : system.coupling[i]) {
      H.block(first[i], first[j], part.rows(), part.cols()) = part;
      if (i >= count) H.block(first[j], first[i], part.cols(), part.rows()) = part.transpose();
    }
  }
  RowMatrix U = H.topLeftCorner(left, left);
  for (double lift = kSmallestLift; !cholesky(U); lift *= 10.0) {
    if (lift > kLargestLift) throw std::runtime_error("graph: a block that leaves is not determined");
    U = H.topLeftCorner(left, left);
    U.diagonal() *= 1.0 + lift;
  }
  const Eigen::Index kept = rows - left;
  RowMatrix W = H.topRightCorner(left, kept + 1);
  RowMatrix S = H.bottomRightCorner(kept + 1, kept + 1);
  forwardSubstitute(U, W);
  addProduct(W, W, -1.0, S);
  return {S.topLeftCorner(kept, kept), S.col(kept).head(kept)};
}

SquareRoot squareRoot(const Information& information) {
  const Eigen::Index n = information.S.rows();
  // The entries differ by many orders of magnitude (metres, biases): scale to a unit diagonal first, so that
  // "carries no information" does not depend on the units.
  const Eigen::VectorXd scale = information.S.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Eigen::VectorXd inverse =
      (scale.array() > 0.0).select(scale.cwiseInverse(), Eigen::VectorXd::Zero(n));
  const Eigen::MatrixXd scaled = inverse.asDiagonal() * information.S * inverse.asDiagonal();
  const Eigen::VectorXd scaled_s = inverse.cwiseProduct(information.s);
  SquareRoot root{Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)};
  RowMatrix U = scaled;
  if (cholesky(U) && U.diagonal().minCoeff() > kWellDetermined) {
    root.J.triangularView<Eigen::Upper>() = U * scale.asDiagonal();
    root.r0 = scaled_s;
    forwardSubstitute(U, root.r0);
    return root;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled);
  const Eigen::VectorXd& lambda = eigen.eigenvalues();
  const double floor = 1e-12 * std::max(lambda.maxCoeff(), 0.0);
  for (Eigen::Index i = 0; i < n; ++i) {
    if (lambda(i) <= floor) continue;
    const Eigen::VectorXd v = eigen.eigenvectors().col(i);
    root.J.row(i) = std::sqrt(lambda(i)) * v.cwiseProduct(scale).transpose();
    root.r0(i) = v.dot(scaled_s) / std::sqrt(lambda(i));
  }
  return root;
}

}  // namespace rio_t
