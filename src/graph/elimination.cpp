#include "rio_t/graph/elimination.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <stdexcept>
#include <utility>

namespace rio_t {
namespace {

/// Rounding leaves some 1e-15 of a column that the rows do not determine.
constexpr double kNothing = 1e-14;

/// Rows of numbers, one after the other. Keeps its memory.
class Tableau {
 public:
  void reset(Eigen::Index rows, Eigen::Index columns) {
    rows_ = rows;
    columns_ = columns;
    stride_ = columns + 3;  // the last part of a row may reach beyond it, over zeros
    numbers_.assign(static_cast<std::size_t>(rows * stride_), 0.0);
  }
  Eigen::Index rows() const { return rows_; }
  double* row(Eigen::Index i) { return numbers_.data() + i * stride_; }
  const double* row(Eigen::Index i) const { return numbers_.data() + i * stride_; }

  /// Householder reflections that clear the columns from `first` to `end` below the diagonal. They pass over
  /// rows with a zero in the column: most derivatives are zero.
  void triangularise(Eigen::Index first, Eigen::Index end) {
    for (Eigen::Index k = first; k < std::min(end, rows_ - 1); ++k) {
      const double pivot = row(k)[k];
      double square = pivot * pivot;
      reflected_.assign(1, {row(k), pivot});
      double* at = row(k + 1);
      for (Eigen::Index i = k + 1; i < rows_; ++i, at += stride_) {
        const double squared = at[k] * at[k];
        if (squared < std::numeric_limits<double>::min()) {  // its inverse would not be finite
          at[k] = 0.0;
          continue;
        }
        reflected_.push_back({at, at[k]});
        square += squared;
      }
      if (reflected_.size() == 1) continue;
      const double norm = std::sqrt(square);
      reflected_.front().v += pivot > 0.0 ? norm : -norm;
      const double scale = 1.0 / (norm * (norm + std::abs(pivot)));
      // 16 sums fill the registers; narrower parts waste less at the end of a row.
      for (Eigen::Index part = k + 1; part < columns_;) {
        const Eigen::Index left = columns_ - part;
        part += left > 12  ? reflect<16>(part, scale)
                : left > 4 ? reflect<8>(part, scale)
                           : reflect<4>(part, scale);
      }
      for (const Reflected& each : reflected_) each.row[k] = 0.0;
      row(k)[k] = pivot > 0.0 ? -norm : norm;
    }
  }

 private:
  struct Reflected {
    double* row;
    double v;  ///< of the reflection I - scale v v'
  };

  /// Reflects some columns from `part` on, and returns how many. The sums stay in registers.
  template <int Width>
  int reflect(Eigen::Index part, double scale) {
    using Part = Eigen::Array<double, Width, 1>;
    Part sums = Part::Zero();
    for (const Reflected& each : reflected_) sums += each.v * Eigen::Map<const Part>(each.row + part);
    sums *= scale;
    for (const Reflected& each : reflected_) Eigen::Map<Part>(each.row + part) -= each.v * sums;
    return Width;
  }

  Eigen::Index rows_ = 0, columns_ = 0, stride_ = 0;
  std::vector<double> numbers_;
  std::vector<Reflected> reflected_;
};

/// The rows of a tableau from `from` on, as many as columns.
SquareRoot squareRootOf(const Tableau& tableau, Eigen::Index from, Eigen::Index columns) {
  SquareRoot result{Eigen::MatrixXd::Zero(columns, columns), Eigen::VectorXd::Zero(columns)};
  for (Eigen::Index i = 0; i < std::min(columns, tableau.rows() - from); ++i) {
    const Eigen::Map<const Eigen::RowVectorXd> row(tableau.row(from + i) + from, columns + 1);
    result.J.row(i) = row.head(columns);
    result.r0[i] = row[columns];
  }
  return result;
}

/// Eliminates the blocks of a system, first to last.
class BlockElimination {
 public:
  explicit BlockElimination(const LinearSystem& system) : system_(system), waiting_(system.tangents.size()) {
    squares_.reserve(system.tangents.size());
    for (std::size_t i = 0; i < system.tangents.size(); ++i)
      squares_.emplace_back(Eigen::VectorXd::Zero(system.tangent(static_cast<int>(i))));
    for (const LinearRows& each : system.rows) {
      if (each.blocks.empty()) continue;
      waiting_[static_cast<std::size_t>(each.blocks.front())].push_back(&each);
      Eigen::Index first = 0;
      for (const int k : each.blocks) {
        Eigen::VectorXd& squares = squares_[static_cast<std::size_t>(k)];
        squares += each.Jr.middleCols(first, squares.size()).colwise().squaredNorm().transpose();
        first += squares.size();
      }
    }
  }

  /// Rows of R of block i; none if the rows do not determine it. The other rows wait for later blocks.
  std::optional<LinearRows> eliminate(int i) {
    const std::vector<const LinearRows*> stacked = std::exchange(waiting_[static_cast<std::size_t>(i)], {});
    const Eigen::VectorXd& squares = squares_[static_cast<std::size_t>(i)];
    const Eigen::Index own = squares.size();
    columns_.assign(1, i);
    Eigen::Index rows = 0;
    for (const LinearRows* each : stacked) {
      columns_.insert(columns_.end(), each->blocks.begin(), each->blocks.end());
      rows += each->Jr.rows();
    }
    std::sort(columns_.begin(), columns_.end());
    columns_.erase(std::unique(columns_.begin(), columns_.end()), columns_.end());
    starts_.clear();
    Eigen::Index others = 0;
    for (const int k : columns_) {
      starts_.push_back(others);
      others += system_.tangent(k);
    }
    if (rows < own) return std::nullopt;
    const Eigen::Index last = others;  // the column of r
    tableau_.reset(rows, last + 1);
    Eigen::Index row = 0;
    for (const LinearRows* each : stacked) row = stack(*each, row, last);
    tableau_.triangularise(0, own);
    for (Eigen::Index k = 0; k < own; ++k)
      if (!(std::abs(tableau_.row(k)[k]) > kNothing * std::sqrt(squares[k]))) return std::nullopt;
    keepRest(own, last);
    return copied(0, 0, own, last);
  }

  /// The rows that still wait, over the blocks from `first` on that are not held.
  SquareRoot rest(int first) {
    columns_.clear();
    starts_.clear();
    Eigen::Index last = 0, rows = 0;
    for (int k = first; k < static_cast<int>(waiting_.size()); ++k) {
      if (system_.is_held[static_cast<std::size_t>(k)]) continue;
      columns_.push_back(k);
      starts_.push_back(last);
      last += system_.tangent(k);
      for (const LinearRows* each : waiting_[static_cast<std::size_t>(k)]) rows += each->Jr.rows();
    }
    tableau_.reset(rows, last + 1);
    Eigen::Index row = 0;
    for (const int k : columns_)
      for (const LinearRows* each : waiting_[static_cast<std::size_t>(k)]) row = stack(*each, row, last);
    tableau_.triangularise(0, last);
    return squareRootOf(tableau_, 0, last);
  }

 private:
  /// Copies rows into the tableau; returns the row after them.
  Eigen::Index stack(const LinearRows& rows, Eigen::Index row, Eigen::Index last) {
    for (Eigen::Index i = 0; i < rows.Jr.rows(); ++i, ++row) {
      const double* from = rows.Jr.data() + i * rows.Jr.cols();
      double* const to = tableau_.row(row);
      std::size_t at = 0;
      for (const int k : rows.blocks) {
        while (columns_[at] != k) ++at;
        const Eigen::Index width = system_.tangent(k);
        std::copy_n(from, width, to + starts_[at]);
        from += width;
      }
      to[last] = *from;
    }
    return row;
  }

  /// Keeps the rows below the first `own`. As many as the next block has columns wait for it, the others for
  /// the block after it. No more wait than have columns: in a batch they would pile up.
  void keepRest(Eigen::Index own, Eigen::Index last) {
    if (columns_.size() == 1) return;
    const Eigen::Index next = columns_.size() > 2 ? starts_[2] : last;
    tableau_.triangularise(own, tableau_.rows() > last ? last : next);
    const Eigen::Index rows = std::min(tableau_.rows(), last);
    keep(1, own, std::min(next, rows), last);
    keep(2, next, rows, last);
  }

  /// The rows from `first` to `end` wait for the block columns_[at].
  void keep(std::size_t at, Eigen::Index first, Eigen::Index end, Eigen::Index last) {
    if (first >= end) return;
    const LinearRows& rest = rest_.emplace_back(copied(at, first, end, last));
    // First of all: those of the next block are triangular, so few of them are reflected.
    auto& waiting = waiting_[static_cast<std::size_t>(rest.blocks.front())];
    waiting.insert(waiting.begin(), &rest);
  }

  /// The rows from `first` to `end`, from the block columns_[at] on.
  LinearRows copied(std::size_t at, Eigen::Index first, Eigen::Index end, Eigen::Index last) const {
    LinearRows result;
    result.blocks.assign(columns_.begin() + static_cast<std::ptrdiff_t>(at), columns_.end());
    result.Jr.resize(end - first, last + 1 - starts_[at]);
    for (Eigen::Index i = first; i < end; ++i)
      std::copy_n(tableau_.row(i) + starts_[at], result.Jr.cols(),
                  result.Jr.data() + (i - first) * result.Jr.cols());
    return result;
  }

  const LinearSystem& system_;
  std::vector<Eigen::VectorXd> squares_;                 ///< of the columns of each block
  std::vector<std::vector<const LinearRows*>> waiting_;  ///< by their first block
  std::deque<LinearRows> rest_;
  // The columns of the block that is being eliminated: their blocks, and where each begins.
  std::vector<int> columns_;
  std::vector<Eigen::Index> starts_;
  Tableau tableau_;
};

/// Some columns of a matrix by rows.
using Columns = Eigen::Map<const RowMatrix, 0, Eigen::OuterStride<>>;

// Row by row: at these sizes Eigen's products and triangular solves cost several times as much.

/// sum += sign A' B.
template <typename Left>
void addProduct(const Left& A, const RowMatrix& B, double sign, RowMatrix& sum) {
  for (Eigen::Index k = 0; k < A.rows(); ++k)
    for (Eigen::Index i = 0; i < A.cols(); ++i)
      if (A(k, i) != 0.0) sum.row(i) += sign * A(k, i) * B.row(k);
}

/// W <- R'^-1 W for the upper triangle R.
void forwardSubstitute(const Columns& R, RowMatrix& W) {
  for (Eigen::Index i = 0; i < R.rows(); ++i) {
    for (Eigen::Index j = 0; j < i; ++j) W.row(i) -= R(j, i) * W.row(j);
    W.row(i) /= R(i, i);
  }
}

/// Calls part(j, R_ij) for each block that the rows of block i touch, R_ii first.
template <typename Part>
void eachBlock(const LinearRows& rows, const std::vector<Eigen::Index>& tangents, const Part& part) {
  const double* first = rows.Jr.data();
  for (const int j : rows.blocks) {
    const Eigen::Index width = tangents[static_cast<std::size_t>(j)];
    part(static_cast<std::size_t>(j),
         Columns(first, rows.Jr.rows(), width, Eigen::OuterStride<>(rows.Jr.cols())));
    first += width;
  }
}

}  // namespace

std::optional<Elimination> Elimination::of(const LinearSystem& system) {
  Elimination result;
  const std::size_t count = system.tangents.size();
  result.tangents_ = system.tangents;
  result.R_.reserve(count);
  result.delta_.reserve(count);
  BlockElimination elimination(system);
  for (std::size_t i = 0; i < count; ++i) {
    const auto block = static_cast<int>(i);
    if (system.is_held[i]) {
      const Eigen::Index size = system.tangents[i];
      result.R_.push_back({{block}, RowMatrix::Identity(size, size + 1)});
    } else if (auto rows = elimination.eliminate(block)) {
      result.R_.push_back(std::move(*rows));
    } else {
      return std::nullopt;
    }
    const auto z = result.R_.back().Jr.rightCols<1>();
    result.squared_length_ += z.squaredNorm();
    result.delta_.emplace_back(-z);
  }
  for (std::size_t i = count; i-- > 0;) {
    Eigen::VectorXd& delta = result.delta_[i];
    eachBlock(result.R_[i], result.tangents_, [&](std::size_t j, const Columns& R_ij) {
      if (j == i) return;
      delta.noalias() -= R_ij.lazyProduct(result.delta_[j]);
    });
    result.R_[i].Jr.leftCols(delta.size()).triangularView<Eigen::Upper>().solveInPlace(delta);
  }
  return result;
}

Eigen::MatrixXd Elimination::covariance(const std::vector<int>& indices) const {
  Eigen::Index columns = 0;
  for (const int i : indices) columns += tangents_[static_cast<std::size_t>(i)];
  // Y = R'^-1 E, where E selects the blocks: their covariance is Y'Y.
  std::vector<RowMatrix> Y(R_.size());
  Eigen::Index first = 0;
  for (const int i : indices) {
    const Eigen::Index size = tangents_[static_cast<std::size_t>(i)];
    Y[static_cast<std::size_t>(i)].setZero(size, columns);
    Y[static_cast<std::size_t>(i)].middleCols(first, size).setIdentity();
    first += size;
  }
  RowMatrix result = RowMatrix::Zero(columns, columns);
  for (std::size_t i = 0; i < R_.size(); ++i) {
    if (Y[i].size() == 0) continue;
    eachBlock(R_[i], tangents_, [&](std::size_t j, const Columns& R_ij) {
      if (j == i) {
        forwardSubstitute(R_ij, Y[i]);
      } else {
        if (Y[j].size() == 0) Y[j].setZero(R_ij.cols(), columns);
        addProduct(R_ij, Y[i], -1.0, Y[j]);
      }
    });
    addProduct(Y[i], Y[i], 1.0, result);
  }
  return result;
}

std::vector<std::map<int, Eigen::MatrixXd>> Elimination::covariances() const {
  std::vector<std::map<int, Eigen::MatrixXd>> P(R_.size());
  const auto at = [&](int a, int b) -> Eigen::MatrixXd {
    return a <= b ? P[a].at(b) : Eigen::MatrixXd(P[b].at(a).transpose());
  };
  for (std::size_t i = R_.size(); i-- > 0;) {
    const Eigen::Index size = tangents_[i];
    const RowMatrix& rows = R_[i].Jr;
    const Eigen::MatrixXd inverse =
        rows.leftCols(size).triangularView<Eigen::Upper>().solve(Eigen::MatrixXd::Identity(size, size));
    P[i][static_cast<int>(i)] = inverse * inverse.transpose();
    // delta_i = G_i (...) - sum_j G_ij delta_j with G_ij = R_ii^-1 R_ij.
    std::map<int, Eigen::MatrixXd> G;
    Eigen::Index first = size;
    for (auto j = R_[i].blocks.begin() + 1; j != R_[i].blocks.end(); ++j) {
      const Eigen::Index width = tangents_[static_cast<std::size_t>(*j)];
      G[*j] = inverse * rows.middleCols(first, width);
      first += width;
    }
    for (const auto& [j, unused] : G) {
      Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(size, tangents_[static_cast<std::size_t>(j)]);
      for (const auto& [k, G_ik] : G) sum.noalias() -= G_ik * at(k, j);
      P[i][static_cast<int>(i)].noalias() -= sum * G[j].transpose();
      P[i][j] = std::move(sum);
    }
  }
  return P;
}

SquareRoot compressed(const SquareRoot& rows) { return widened(rows, Eigen::VectorXd::Zero(rows.J.cols())); }

SquareRoot eliminateFirst(const LinearSystem& system, int count) {
  BlockElimination elimination(system);
  for (int i = 0; i < count; ++i)
    if (!system.is_held[static_cast<std::size_t>(i)] && !elimination.eliminate(i))
      throw std::runtime_error("graph: a block that leaves is not determined");
  return elimination.rest(count);
}

SquareRoot widened(const SquareRoot& known, const Eigen::VectorXd& variances) {
  // Rows in (w, x'): x = x' - w, and w = 0 +- its sigma.
  const Eigen::Index walk = (variances.array() > 0.0).count();
  const Eigen::Index columns = known.J.cols(), rows = known.J.rows();
  Tableau tableau;
  tableau.reset(walk + rows, walk + columns + 1);
  for (Eigen::Index i = 0; i < rows; ++i) {
    Eigen::Map<Eigen::RowVectorXd>(tableau.row(walk + i) + walk, columns + 1) << known.J.row(i), known.r0[i];
  }
  for (Eigen::Index k = 0, w = 0; k < columns; ++k) {
    if (!(variances[k] > 0.0)) continue;
    tableau.row(w)[w] = 1.0 / std::sqrt(variances[k]);
    for (Eigen::Index i = 0; i < rows; ++i) tableau.row(walk + i)[w] = -known.J(i, k);
    ++w;
  }
  tableau.triangularise(0, walk + columns);
  return squareRootOf(tableau, walk, columns);
}

}  // namespace rio_t
