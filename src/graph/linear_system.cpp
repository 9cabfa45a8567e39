#include "rio_t/graph/linear_system.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <unordered_map>
#include <utility>

namespace rio_t {
namespace {

/// Evaluates terms. Reuses its memory from term to term.
class Evaluation {
 public:
  /// The rows of a term. `indices` of its blocks: -1 for a block that is not solved for.
  LinearRows rowsOf(const Term& term, const std::vector<int>& indices) {
    const Eigen::Index rows = term.cost->num_residuals();
    if (numbers_.size() < term.blocks.size()) numbers_.resize(term.blocks.size());
    jacobians_.clear();
    order_.clear();
    Eigen::Index columns = 1;
    for (std::size_t i = 0; i < term.blocks.size(); ++i) {
      const Manifold& manifold = *term.blocks[i]->manifold;
      numbers_[i].resize(static_cast<std::size_t>(rows * manifold.size()));
      jacobians_.push_back(indices[i] < 0 ? nullptr : numbers_[i].data());
      if (indices[i] < 0) continue;
      order_.push_back(i);
      columns += manifold.tangent();
    }
    std::sort(order_.begin(), order_.end(),
              [&](std::size_t a, std::size_t b) { return indices[a] < indices[b]; });
    const double root = std::sqrt(evaluate(term, jacobians_.data()));
    LinearRows result;
    result.Jr.resize(rows, columns);
    Eigen::Index to = 0;
    for (const std::size_t i : order_) {
      const Manifold& manifold = *term.blocks[i]->manifold;
      const Eigen::Map<const RowMatrix> from(numbers_[i].data(), rows, manifold.size());
      for (const int column : manifold.columns()) result.Jr.col(to++) = root * from.col(column);
    }
    result.Jr.col(to) = root * residuals();
    result.blocks.reserve(order_.size());
    for (const std::size_t i : order_) result.blocks.push_back(indices[i]);
    return result;
  }
  /// Without derivatives.
  double costOf(const Term& term) {
    evaluate(term, nullptr);
    return cost_;
  }
  double cost() const { return cost_; }

 private:
  /// Sets residual and cost; returns the derivative of the loss.
  double evaluate(const Term& term, double** jacobians) {
    r_.resize(static_cast<std::size_t>(term.cost->num_residuals()));
    parameters_.clear();
    for (const Block* block : term.blocks) parameters_.push_back(block->x.data());
    if (!term.cost->Evaluate(parameters_.data(), r_.data(), jacobians))
      throw std::runtime_error("graph: a factor cannot be evaluated");
    double rho[3] = {residuals().squaredNorm(), 1.0, 0.0};
    if (term.loss) term.loss->Evaluate(rho[0], rho);
    cost_ = 0.5 * rho[0];
    return rho[1];
  }

  Eigen::Map<const Eigen::VectorXd> residuals() const {
    return {r_.data(), static_cast<Eigen::Index>(r_.size())};
  }

  std::vector<double> r_;
  std::vector<std::vector<double>> numbers_;
  std::vector<const double*> parameters_;
  std::vector<double*> jacobians_;
  std::vector<std::size_t> order_;
  double cost_ = 0.0;
};

}  // namespace

int LinearSystem::indexOf(const Block& block) const {
  const auto found = std::find(blocks.rbegin(), blocks.rend(), &block);
  return static_cast<int>(blocks.rend() - found) - 1;
}

Eigen::VectorXd LinearSystem::gradient(int i) const {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(tangent(i));
  for (const LinearRows& each : rows) {
    Eigen::Index first = 0;
    for (const int k : each.blocks) {
      if (k == i) sum += each.Jr.middleCols(first, sum.size()).transpose() * each.Jr.rightCols<1>();
      first += tangent(k);
    }
  }
  return sum;
}

void LinearSystem::hold(int i) {
  is_held[static_cast<std::size_t>(i)] = true;
  for (LinearRows& each : rows) {
    const auto at = std::find(each.blocks.begin(), each.blocks.end(), i);
    if (at == each.blocks.end()) continue;
    const Eigen::Index first = std::accumulate(each.blocks.begin(), at, Eigen::Index{0},
                                               [&](Eigen::Index sum, int k) { return sum + tangent(k); });
    const Eigen::Index after = each.Jr.cols() - first - tangent(i);
    RowMatrix rest(each.Jr.rows(), first + after);
    rest << each.Jr.leftCols(first), each.Jr.rightCols(after);
    each.Jr = std::move(rest);
    each.blocks.erase(at);
  }
}

LinearSystem linearize(std::vector<const Block*> blocks, const std::vector<const Term*>& terms) {
  LinearSystem system;
  system.blocks = std::move(blocks);
  std::unordered_map<const Block*, int> index;
  for (const Block* block : system.blocks) {
    system.tangents.push_back(block->manifold->tangent());
    system.is_held.push_back(block->is_constant);
    index.emplace(block, block->is_constant ? -1 : static_cast<int>(index.size()));
  }
  Evaluation evaluation;
  std::vector<int> indices;
  system.rows.reserve(terms.size());
  for (const Term* term : terms) {
    indices.clear();
    for (const Block* block : term->blocks) {
      const auto found = index.find(block);
      indices.push_back(found == index.end() ? -1 : found->second);
    }
    system.rows.push_back(evaluation.rowsOf(*term, indices));
    system.cost += evaluation.cost();
  }
  return system;
}

LinearSystem linearize(const Window& window) {
  std::vector<const Block*> blocks;
  std::vector<const Term*> terms;
  for (const auto& block : window.blocks()) blocks.push_back(block.get());
  for (const auto& term : window.terms()) terms.push_back(term.get());
  return linearize(std::move(blocks), terms);
}

double costOf(const Window& window) {
  Evaluation evaluation;
  double cost = 0.0;
  for (const auto& term : window.terms()) cost += evaluation.costOf(*term);
  return cost;
}

}  // namespace rio_t
