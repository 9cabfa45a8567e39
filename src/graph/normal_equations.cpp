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

/// Some rows of numbers, one after the other.
struct Rows {
  const double* data;
  Eigen::Index rows, columns;
};
Rows rowsOf(const RowMatrix& A) { return {A.data(), A.rows(), A.cols()}; }

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

/// Column `i` of A times N columns of B, from column `first` on, added to `to`. The sums stay in registers.
template <int N>
void addColumnProduct(const Rows& A, Eigen::Index i, const Rows& B, Eigen::Index first, double sign,
                      double* to) {
  std::array<double, N> sums{};
  std::copy_n(to, N, sums.begin());
  for (Eigen::Index row = 0; row < A.rows; ++row) {
    const double a = sign * A.data[row * A.columns + i];
    if (a == 0.0) continue;
    const double* const b = B.data + row * B.columns + first;
    for (std::size_t j = 0; j < N; ++j) sums[j] += a * b[j];
  }
  std::copy_n(sums.begin(), N, to);
}

/// sum += sign A' B. Most derivatives are zero, and at these sizes Eigen's blocked product costs several
/// times as much.
void addProduct(const Rows& A, const Rows& B, double sign, RowMatrix& sum) {
  if (sum.size() == 0) sum.setZero(A.columns, B.columns);
  inParts(B.columns, [A, B, sign, to = sum.data()](Eigen::Index first, auto width) {
    for (Eigen::Index i = 0; i < A.columns; ++i)
      addColumnProduct<width>(A, i, B, first, sign, to + i * B.columns + first);
  });
}

/// sum += sign A' A, of which the lower triangle counts.
void addSquare(const Rows& A, double sign, RowMatrix& sum) {
  constexpr int kState = 15, kHalf = 8;
  if (A.columns != kState) return addProduct(A, A, sign, sum);
  // Two lengths that the compiler knows are faster than the exact one.
  double* to = sum.data();
  for (Eigen::Index i = 0; i < kHalf; ++i, to += kState) addColumnProduct<kHalf>(A, i, A, 0, sign, to);
  for (Eigen::Index i = kHalf; i < kState; ++i, to += kState) addColumnProduct<kState>(A, i, A, 0, sign, to);
}

/// sum += sign A' x.
void addProduct(const Rows& A, const Eigen::VectorXd& x, double sign, Eigen::VectorXd& sum) {
  for (Eigen::Index row = 0; row < A.rows; ++row)
    for (Eigen::Index i = 0; i < A.columns; ++i) sum[i] += sign * x[row] * A.data[row * A.columns + i];
}

/// N columns of W <- L^-1 W, from column `first` on.
template <int N>
void forwardSubstitute(const RowMatrix& L, Eigen::Index first, RowMatrix& W) {
  for (Eigen::Index i = 0; i < L.rows(); ++i) {
    double* const to = W.data() + i * W.cols() + first;
    std::array<double, N> sums{};
    std::copy_n(to, N, sums.begin());
    for (Eigen::Index j = 0; j < i; ++j) {
      const double factor = L(i, j);
      const double* const from = W.data() + j * W.cols() + first;
      for (std::size_t k = 0; k < N; ++k) sums[k] -= factor * from[k];
    }
    const double inverse = 1.0 / L(i, i);
    for (std::size_t k = 0; k < N; ++k) to[k] = sums[k] * inverse;
  }
}

/// W <- L^-1 W for the lower triangle of L.
void forwardSubstitute(const RowMatrix& L, RowMatrix& W) {
  inParts(W.cols(), [&](Eigen::Index first, auto width) { forwardSubstitute<width>(L, first, W); });
}

/// S <- its Cholesky factor, in the lower triangle. False where S is not positive definite.
bool cholesky(RowMatrix& S) {
  using State = Eigen::Matrix<double, 15, 15, Eigen::RowMajor>;
  if (S.rows() == State::RowsAtCompileTime) {
    Eigen::Map<State> state(S.data());
    const Eigen::LLT<State> factor(state);
    state = factor.matrixLLT();
    return factor.info() == Eigen::Success;
  }
  return Eigen::LLT<Eigen::Ref<RowMatrix>>(S).info() == Eigen::Success;
}

/// Residual and derivatives of a term with respect to the tangents of its blocks, after the loss. Keeps its
/// memory from term to term.
class Linearized {
 public:
  void evaluate(const Term& term) {
    const Eigen::Index rows = term.cost->num_residuals();
    if (numbers_.size() < term.blocks.size()) numbers_.resize(term.blocks.size());
    jacobians_.clear();
    for (std::size_t i = 0; i < term.blocks.size(); ++i) {
      const auto size = static_cast<std::size_t>(rows * term.blocks[i]->manifold->size());
      if (numbers_[i].size() < size) numbers_[i].resize(size);
      jacobians_.push_back(term.blocks[i]->is_constant ? nullptr : numbers_[i].data());
    }
    const double root = std::sqrt(evaluate(term, jacobians_.data()));
    r_ *= root;
    J_.clear();
    for (std::size_t i = 0; i < term.blocks.size(); ++i) {
      const bool is_constant = jacobians_[i] == nullptr;
      J_.push_back(is_constant ? Rows{nullptr, rows, 0} : tangents(i, *term.blocks[i]->manifold, root));
    }
  }
  /// Without derivatives.
  double costOf(const Term& term) {
    evaluate(term, nullptr);
    return cost_;
  }
  const Eigen::VectorXd& r() const { return r_; }
  const Rows& J(std::size_t i) const { return J_[i]; }
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

  /// Moves the columns that carry the tangent together.
  Rows tangents(std::size_t i, const Manifold& manifold, double root) {
    const std::vector<int>& columns = manifold.columns();
    double* to = numbers_[i].data();
    const double* from = to;
    for (Eigen::Index row = 0; row < r_.size(); ++row, from += manifold.size())
      for (const int column : columns) *to++ = root * from[column];
    return {numbers_[i].data(), r_.size(), static_cast<Eigen::Index>(columns.size())};
  }

  Eigen::VectorXd r_;
  std::vector<std::vector<double>> numbers_;
  std::vector<const double*> parameters_;
  std::vector<double*> jacobians_;
  std::vector<Rows> J_;
  double cost_ = 0.0;
};

void addTo(NormalEquations& system, const Term& term, const std::unordered_map<const Block*, int>& index,
           Linearized& linear) {
  linear.evaluate(term);
  system.cost += linear.cost();
  std::vector<int> indices;  // -1: not solved for
  for (const Block* block : term.blocks) {
    const auto found = index.find(block);
    indices.push_back(found == index.end() || block->is_constant ? -1 : found->second);
  }
  for (std::size_t a = 0; a < indices.size(); ++a) {
    const int i = indices[a];
    if (i < 0) continue;
    addSquare(linear.J(a), 1.0, system.diagonal[i]);
    addProduct(linear.J(a), linear.r(), 1.0, system.gradient[i]);
    for (std::size_t b = 0; b < indices.size(); ++b)
      if (indices[b] > i) addProduct(linear.J(a), linear.J(b), 1.0, system.coupling[i][indices[b]]);
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
  for (int k = 0; k < i; ++k) coupling[k].erase(i);
  coupling[i].clear();
  diagonal[i].setIdentity();
  gradient[i].setZero();
}

NormalEquations linearize(std::vector<const Block*> blocks, const std::vector<const Term*>& terms) {
  NormalEquations system(std::move(blocks));
  std::unordered_map<const Block*, int> index;
  for (std::size_t i = 0; i < system.blocks.size(); ++i) index[system.blocks[i]] = static_cast<int>(i);
  Linearized linear;
  for (const Term* term : terms) addTo(system, *term, index, linear);
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
  L_ = system.diagonal;
  W_ = system.coupling;
  delta_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    delta_[i] = -system.gradient[i];
    L_[i].diagonal() *= 1.0 + raise;
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (!cholesky(L_[i])) return false;
    L_[i].triangularView<Eigen::Lower>().solveInPlace(delta_[i]);
    for (auto& [j, W] : W_[i]) {
      forwardSubstitute(L_[i], W);
      addProduct(rowsOf(W), delta_[i], -1.0, delta_[j]);
    }
    for (auto a = W_[i].begin(); a != W_[i].end(); ++a) {
      addSquare(rowsOf(a->second), -1.0, L_[a->first]);
      auto& row = W_[a->first];
      auto to = row.begin();
      for (auto b = std::next(a); b != W_[i].end(); ++b, ++to) {
        while (to != row.end() && to->first < b->first) ++to;
        to = row.try_emplace(to, b->first);
        addProduct(rowsOf(a->second), rowsOf(b->second), -1.0, to->second);
      }
    }
  }
  squared_length_ = 0.0;
  for (std::size_t i = count; i-- > 0;) {
    for (const auto& [j, W] : W_[i]) delta_[i].noalias() -= W * delta_[j];
    L_[i].triangularView<Eigen::Lower>().transpose().solveInPlace(delta_[i]);
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

Eigen::MatrixXd Elimination::covariance(const std::vector<int>& indices) const {
  Eigen::Index columns = 0;
  for (const int i : indices) columns += L_[i].rows();
  // Y = L^-1 E, where E selects the blocks: their covariance is Y'Y.
  std::map<int, RowMatrix> Y;
  Eigen::Index first = 0;
  for (const int i : indices) {
    Y[i].setZero(L_[i].rows(), columns);
    Y[i].middleCols(first, L_[i].rows()).setIdentity();
    first += L_[i].rows();
  }
  RowMatrix result = RowMatrix::Zero(columns, columns);
  for (auto at = Y.begin(); at != Y.end(); ++at) {
    auto& [i, y] = *at;
    forwardSubstitute(L_[i], y);
    for (const auto& [j, W] : W_[i]) addProduct(rowsOf(W), rowsOf(y), -1.0, Y[j]);
    addProduct(rowsOf(y), rowsOf(y), 1.0, result);
  }
  return result;
}

std::vector<std::map<int, Eigen::MatrixXd>> Elimination::covariances() const {
  std::vector<std::map<int, Eigen::MatrixXd>> P(L_.size());
  const auto at = [&](int a, int b) -> Eigen::MatrixXd {
    return a <= b ? P[a].at(b) : Eigen::MatrixXd(P[b].at(a).transpose());
  };
  for (std::size_t i = L_.size(); i-- > 0;) {
    const auto L = L_[i].triangularView<Eigen::Lower>();
    const Eigen::MatrixXd inverse = L.solve(Eigen::MatrixXd::Identity(L_[i].rows(), L_[i].rows()));
    P[i][static_cast<int>(i)] = inverse.transpose() * inverse;
    // delta_i = G_i (...) - sum_j G_ij delta_j with G_ij = L_ii^-T W_ij.
    std::map<int, Eigen::MatrixXd> G;
    for (const auto& [j, W] : W_[i]) G[j] = L.transpose().solve(W);
    for (const auto& [j, unused] : G) {
      Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(L_[i].rows(), L_[j].rows());
      for (const auto& [k, G_ik] : G) sum.noalias() -= G_ik * at(k, j);
      P[i][static_cast<int>(i)].noalias() -= sum * G[j].transpose();
      P[i][j] = std::move(sum);
    }
  }
  return P;
}

Information eliminateFirst(const NormalEquations& system, int count) {
  const int blocks = static_cast<int>(system.blocks.size());
  Eigen::Index rows = 0, first_rows = 0;
  std::vector<Eigen::Index> first;
  for (int i = 0; i < blocks; ++i) {
    first.push_back(rows);
    rows += system.diagonal[i].rows();
    if (i < count) first_rows = rows;
  }
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(rows, rows);
  Eigen::VectorXd b(rows);
  for (int i = 0; i < blocks; ++i) {
    b.segment(first[i], system.gradient[i].size()) = system.gradient[i];
    H.block(first[i], first[i], system.diagonal[i].rows(), system.diagonal[i].rows()) = system.diagonal[i];
    for (const auto& [j, part] : system.coupling[i]) {
      H.block(first[i], first[j], part.rows(), part.cols()) = part;
      H.block(first[j], first[i], part.cols(), part.rows()) = part.transpose();
    }
  }
  const Eigen::Index kept = rows - first_rows;
  Eigen::MatrixXd H00 = H.topLeftCorner(first_rows, first_rows);
  Eigen::LLT<Eigen::MatrixXd> factor(H00);
  for (double lift = kSmallestLift; factor.info() != Eigen::Success; lift *= 10.0) {
    if (lift > kLargestLift) throw std::runtime_error("graph: a block that leaves is not determined");
    H00.diagonal() = (1.0 + lift) * H.diagonal().head(first_rows);
    factor.compute(H00);
  }
  const Eigen::MatrixXd W = factor.matrixL().solve(H.topRightCorner(first_rows, kept));
  Information result;
  result.S = H.bottomRightCorner(kept, kept) - W.transpose() * W;
  result.s = b.tail(kept) - W.transpose() * factor.matrixL().solve(b.head(first_rows));
  return result;
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
  const Eigen::LLT<Eigen::MatrixXd> cholesky(scaled);
  if (cholesky.info() == Eigen::Success && cholesky.matrixLLT().diagonal().minCoeff() > kWellDetermined) {
    root.J = Eigen::MatrixXd(cholesky.matrixU()) * scale.asDiagonal();
    root.r0 = cholesky.matrixL().solve(scaled_s);
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
