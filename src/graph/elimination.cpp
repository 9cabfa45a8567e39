#include "rio_t/graph/elimination.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace rio_t {
namespace {

/// If less than this share of a column is left, the rows do not determine it. Rounding leaves some 1e-15.
constexpr double kUndetermined = 1e-14;

/// Columns of zeros behind the last column of a tableau: reflections take several columns at once.
constexpr Eigen::Index kPadding = 3;

RowMatrix zeroTableau(Eigen::Index rows, Eigen::Index columns) {
  return RowMatrix::Zero(rows, columns + kPadding);
}

/// Householder reflections of the rows of a tableau. Reuses its memory.
class Reflections {
 public:
  /// Clears the columns from `first` to `end` below the diagonal. Passes over rows with a zero in the column:
  /// most derivatives are zero.
  void triangularise(Eigen::Index first, Eigen::Index end, RowMatrix& tableau) {
    const Eigen::Index rows = tableau.rows(), columns = tableau.cols() - kPadding;
    reflected_.resize(static_cast<std::size_t>(rows));
    for (Eigen::Index k = first; k < std::min(end, rows - 1); ++k) {
      double& diagonal = tableau(k, k);
      const double pivot = diagonal;
      double square = pivot * pivot;
      Reflected* behind = reflected_.data();
      *behind++ = {&tableau(k, 0), pivot};
      double* at = &tableau(k + 1, 0);
      for (Eigen::Index i = k + 1; i < rows; ++i, at += tableau.cols()) {
        const double squared = at[k] * at[k];
        if (squared < std::numeric_limits<double>::min()) {  // its inverse would not be finite
          at[k] = 0.0;
          continue;
        }
        *behind++ = {at, at[k]};
        square += squared;
      }
      if (behind == reflected_.data() + 1) continue;
      const double norm = std::sqrt(square);
      reflected_.front().v += pivot > 0.0 ? norm : -norm;
      const double scale = 1.0 / (norm * (norm + std::abs(pivot)));
      // 24 sums fit into the registers.
      for (Eigen::Index part = k + 1; part < columns;) {
        const Eigen::Index left = columns - part;
        part += left > 20   ? reflect<24>(part, scale, behind)
                : left > 16 ? reflect<20>(part, scale, behind)
                : left > 12 ? reflect<16>(part, scale, behind)
                : left > 8  ? reflect<12>(part, scale, behind)
                : left > 4  ? reflect<8>(part, scale, behind)
                            : reflect<4>(part, scale, behind);
      }
      for (const Reflected* each = reflected_.data(); each != behind; ++each) each->row[k] = 0.0;
      diagonal = pivot > 0.0 ? -norm : norm;
    }
  }

 private:
  struct Reflected {
    double* row;
    double v;  ///< of the reflection I - scale v v'
  };

  /// Reflects some columns from `part` on, and returns how many. The sums stay in registers.
  template <int Width>
  int reflect(Eigen::Index part, double scale, const Reflected* behind) const {
    using Part = Eigen::Array<double, Width, 1>;
    Part sums = Part::Zero();
    for (const Reflected* each = reflected_.data(); each != behind; ++each)
      sums += each->v * Eigen::Map<const Part>(each->row + part);
    sums *= scale;
    for (const Reflected* each = reflected_.data(); each != behind; ++each)
      Eigen::Map<Part>(each->row + part) -= each->v * sums;
    return Width;
  }

  std::vector<Reflected> reflected_;
};

/// The rows of a tableau from `from` on, as many as columns.
SquareRoot squareRootOf(const RowMatrix& tableau, Eigen::Index from, Eigen::Index columns) {
  SquareRoot result{Eigen::MatrixXd::Zero(columns, columns), Eigen::VectorXd::Zero(columns)};
  const Eigen::Index rows = std::min(columns, tableau.rows() - from);
  result.J.topRows(rows) = tableau.block(from, from, rows, columns);
  result.r0.head(rows) = tableau.col(from + columns).segment(from, rows);
  return result;
}

/// Eliminates the blocks of a system, first to last.
class BlockElimination {
 public:
  explicit BlockElimination(const LinearSystem& system)
      : system_(system), eliminated_(system.tangents.size()), waiting_(system.tangents.size(), nullptr) {
    firsts_.reserve(system.tangents.size());
    Eigen::Index columns = 0;
    for (const Eigen::Index tangent : system.tangents) {
      firsts_.push_back(columns);
      columns += tangent;
    }
    squares_.setZero(columns);
    rows_.reserve(system.rows.size() + 2 * system.tangents.size());  // their addresses stay
    for (auto each = system.rows.rbegin(); each != system.rows.rend(); ++each)
      wait(each->blocks.data(), each->blocks.data() + each->blocks.size(), each->Jr, 0, each->Jr.rows(), 0);
  }

  /// Whether the rows determine block i. The rows below those of its R wait for later blocks.
  bool eliminate(int i) {
    const Eigen::Index own = system_.tangent(i);
    columns_.assign(1, i);
    Eigen::Index rows = 0;
    for (const Rows* each = waiting_[i]; each != nullptr; each = each->next) {
      columns_.insert(columns_.end(), each->blocks, each->blocks_end);
      rows += each->count;
    }
    std::sort(columns_.begin(), columns_.end());
    columns_.erase(std::unique(columns_.begin(), columns_.end()), columns_.end());
    starts_.clear();
    Eigen::Index last = 0;  // the column of r
    for (const int k : columns_) {
      starts_.push_back(last);
      last += system_.tangent(k);
    }
    if (rows < own) return false;
    LinearRows& result = eliminated_[i];
    result = {columns_, zeroTableau(rows, last + 1)};
    stack(i, 0, last, result.Jr);
    reflections_.triangularise(0, own, result.Jr);
    // The columns of R are as long as those of J.
    for (std::size_t at = 0; at < columns_.size(); ++at) {
      const Eigen::Index width = system_.tangent(columns_[at]);
      squares_.segment(firsts_[columns_[at]], width) +=
          result.Jr.block(0, starts_[at], own, width).colwise().squaredNorm();
    }
    for (Eigen::Index k = 0; k < own; ++k)
      if (!(std::abs(result.Jr(k, k)) > kUndetermined * std::sqrt(squares_[firsts_[i] + k]))) return false;
    keepRest(own, last, result);
    return true;
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
      for (const Rows* each = waiting_[k]; each != nullptr; each = each->next) rows += each->count;
    }
    RowMatrix tableau = zeroTableau(rows, last + 1);
    Eigen::Index row = 0;
    for (const int k : columns_) row = stack(k, row, last, tableau);
    reflections_.triangularise(0, last, tableau);
    return squareRootOf(tableau, 0, last);
  }

  /// The tableaus of the eliminated blocks.
  std::vector<LinearRows> eliminated() && { return std::move(eliminated_); }

 private:
  /// Some rows of a matrix.
  struct Rows {
    const int *blocks, *blocks_end;
    const double* numbers;  ///< of the first row
    Eigen::Index stride, count;
    const Rows* next;  ///< that wait for the same block
  };

  /// Some rows of a matrix, from a column on, wait for the first of their blocks.
  void wait(const int* blocks, const int* blocks_end, const RowMatrix& from, Eigen::Index row,
            Eigen::Index count, Eigen::Index column) {
    if (blocks == blocks_end || count <= 0) return;
    const Rows*& first = waiting_[*blocks];
    rows_.push_back({blocks, blocks_end, &from(row, column), from.cols(), count, first});
    first = &rows_.back();
  }

  /// Copies the rows that wait for block i into the tableau, from `row` on; returns the row after them.
  Eigen::Index stack(int i, Eigen::Index row, Eigen::Index last, RowMatrix& tableau) const {
    for (const Rows* each = waiting_[i]; each != nullptr; each = each->next) {
      const double* from = each->numbers;
      const auto copyTo = [&](Eigen::Index column, Eigen::Index width) {
        for (Eigen::Index k = 0; k < each->count; ++k)
          std::copy_n(from + k * each->stride, width, &tableau(row + k, column));
        from += width;
      };
      std::size_t at = 0;
      for (const int* block = each->blocks; block != each->blocks_end; ++block) {
        while (columns_[at] != *block) ++at;
        copyTo(starts_[at], system_.tangent(*block));
      }
      copyTo(last, 1);
      row += each->count;
    }
    return row;
  }

  /// Passes on the rows below the first `own`. As many rows as the next block has columns wait for that
  /// block, the others for the block after it. The rows are first reduced to as many as there are columns;
  /// otherwise they would pile up in a batch.
  void keepRest(Eigen::Index own, Eigen::Index last, LinearRows& result) {
    if (columns_.size() == 1) return;
    const Eigen::Index next = columns_.size() > 2 ? starts_[2] : last;
    reflections_.triangularise(own, result.Jr.rows() > last ? last : next, result.Jr);
    const Eigen::Index rows = std::min(result.Jr.rows(), last);
    // These rows come first in the tableau of their block. They are triangular there, so few are reflected.
    const int* const blocks = result.blocks.data();
    const int* const end = blocks + result.blocks.size();
    wait(blocks + 1, end, result.Jr, own, std::min(next, rows) - own, own);
    wait(blocks + 2, end, result.Jr, next, rows - next, next);
  }

  const LinearSystem& system_;
  std::vector<LinearRows> eliminated_;
  std::vector<Rows> rows_;
  std::vector<const Rows*> waiting_;  ///< the first of those that wait for each block
  std::vector<Eigen::Index> firsts_;  ///< column of each block
  Eigen::RowVectorXd squares_;        ///< of the columns of R
  // The columns of the block that is being eliminated: their blocks, and where each begins.
  std::vector<int> columns_;
  std::vector<Eigen::Index> starts_;
  Reflections reflections_;
};

}  // namespace

std::optional<Elimination> Elimination::of(const LinearSystem& system) {
  Elimination result;
  const std::size_t count = system.tangents.size();
  BlockElimination elimination(system);
  for (std::size_t i = 0; i < count; ++i)
    if (!system.is_held[i] && !elimination.eliminate(static_cast<int>(i))) return std::nullopt;
  result.tangents_ = system.tangents;
  result.R_ = std::move(elimination).eliminated();
  result.delta_.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    LinearRows& R = result.R_[i];
    const Eigen::Index size = system.tangents[i];
    if (system.is_held[i]) {
      R = {{static_cast<int>(i)}, zeroTableau(size, size + 1)};
      R.Jr.diagonal().head(size).setConstant(std::numeric_limits<double>::infinity());  // no error, no step
    }
    const auto z = R.Jr.col(R.Jr.cols() - kPadding - 1).head(size);
    result.squared_length_ += z.squaredNorm();
    result.delta_.emplace_back(-z);
  }
  for (std::size_t i = count; i-- > 0;) {
    Eigen::VectorXd& delta = result.delta_[i];
    const LinearRows& R = result.R_[i];
    Eigen::Index first = delta.size();
    for (auto j = R.blocks.begin() + 1; j != R.blocks.end(); ++j) {
      const Eigen::VectorXd& later = result.delta_[static_cast<std::size_t>(*j)];
      delta.noalias() -= R.Jr.block(0, first, delta.size(), later.size()).lazyProduct(later);
      first += later.size();
    }
    R.Jr.topLeftCorner(delta.size(), delta.size()).triangularView<Eigen::Upper>().solveInPlace(delta);
  }
  return result;
}

Eigen::MatrixXd Elimination::covariance(const std::vector<int>& indices) const {
  // Y = R'^-1 E, where E selects the blocks: their covariance is Y'Y. The rows of earlier blocks are zero.
  const auto begin = static_cast<std::size_t>(*std::min_element(indices.begin(), indices.end()));
  std::vector<Eigen::Index> starts(R_.size());
  Eigen::Index rows = 0, columns = 0;
  for (std::size_t i = begin; i < R_.size(); ++i) {
    starts[i] = rows;
    rows += tangents_[i];
  }
  for (const int i : indices) columns += tangents_[i];
  RowMatrix Y = RowMatrix::Zero(rows, columns);
  Eigen::Index first = 0;
  for (const int i : indices) {
    Y.block(starts[i], first, tangents_[i], tangents_[i]).setIdentity();
    first += tangents_[i];
  }
  // Row by row: at these sizes Eigen's triangular solves cost several times as much.
  for (std::size_t i = begin; i < R_.size(); ++i) {
    for (Eigen::Index k = 0; k < tangents_[i]; ++k) {
      auto Y_k = Y.row(starts[i] + k);
      const double* R_k = &R_[i].Jr(k, 0);
      Y_k /= R_k[k];
      for (const int j : R_[i].blocks) {
        const Eigen::Index above = j == static_cast<int>(i) ? k + 1 : 0;
        for (Eigen::Index c = above; c < tangents_[j]; ++c) Y.row(starts[j] + c) -= R_k[c] * Y_k;
        R_k += tangents_[j];
      }
    }
  }
  return Y.transpose() * Y;
}

std::vector<std::map<int, Eigen::MatrixXd>> Elimination::covariances() const {
  std::vector<std::map<int, Eigen::MatrixXd>> P(R_.size());
  const auto at = [&](int a, int b) -> Eigen::MatrixXd {
    return a <= b ? P[a].at(b) : Eigen::MatrixXd(P[b].at(a).transpose());
  };
  for (std::size_t i = R_.size(); i-- > 0;) {
    const Eigen::Index size = tangents_[i];
    const RowMatrix& rows = R_[i].Jr;
    const Eigen::MatrixXd inverse = rows.topLeftCorner(size, size)
                                        .triangularView<Eigen::Upper>()
                                        .solve(Eigen::MatrixXd::Identity(size, size));
    P[i][static_cast<int>(i)] = inverse * inverse.transpose();
    // delta_i = G_i (...) - sum_j G_ij delta_j with G_ij = R_ii^-1 R_ij.
    std::map<int, Eigen::MatrixXd> G;
    Eigen::Index first = size;
    for (auto j = R_[i].blocks.begin() + 1; j != R_[i].blocks.end(); ++j) {
      const Eigen::Index width = tangents_[static_cast<std::size_t>(*j)];
      G[*j] = inverse * rows.block(0, first, size, width);
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
  RowMatrix tableau = zeroTableau(walk + rows, walk + columns + 1);
  tableau.block(walk, walk, rows, columns) = known.J;
  tableau.col(walk + columns).tail(rows) = known.r0;
  for (Eigen::Index k = 0, w = 0; k < columns; ++k) {
    if (!(variances[k] > 0.0)) continue;
    tableau(w, w) = 1.0 / std::sqrt(variances[k]);
    tableau.col(w).tail(rows) = -known.J.col(k);
    ++w;
  }
  Reflections().triangularise(0, walk + columns, tableau);
  return squareRootOf(tableau, walk, columns);
}

}  // namespace rio_t
