#include "rio_t/graph/marginalization.h"

#include <algorithm>
#include <utility>

namespace rio_t {
namespace {

bool contains(const std::vector<const Block*>& blocks, const Block* block) {
  return std::find(blocks.begin(), blocks.end(), block) != blocks.end();
}

}  // namespace

PriorTerm::PriorTerm(std::vector<std::shared_ptr<const Manifold>> manifolds, std::vector<Eigen::VectorXd> x0,
                     SquareRoot root)
    : manifolds_(std::move(manifolds)), x0_(std::move(x0)), root_(std::move(root)) {
  set_num_residuals(static_cast<int>(root_.r0.size()));
  for (const auto& manifold : manifolds_) mutable_parameter_block_sizes()->push_back(manifold->size());
}

bool PriorTerm::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  Eigen::Map<Eigen::VectorXd> r(residuals, num_residuals());
  r = root_.r0;
  Eigen::Index first = 0;
  for (std::size_t i = 0; i < manifolds_.size(); ++i) {
    const Manifold& manifold = *manifolds_[i];
    const auto J = root_.J.middleCols(first, manifold.tangent());
    first += manifold.tangent();
    r.noalias() += J * manifold.minus(parameters[i], x0_[i].data());
    if (jacobians == nullptr || jacobians[i] == nullptr) continue;
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> stored(
        jacobians[i], num_residuals(), manifold.size());
    const Eigen::MatrixXd tangent = J * manifold.minusJacobian(parameters[i], x0_[i].data());
    stored.setZero();
    for (int k = 0; k < manifold.tangent(); ++k) stored.col(manifold.columns()[k]) = tangent.col(k);
  }
  return true;
}

Term& addPrior(Window& window, const std::vector<Block*>& blocks, const SquareRoot& root) {
  std::vector<std::shared_ptr<const Manifold>> manifolds;
  std::vector<Eigen::VectorXd> x0;
  for (const Block* block : blocks) {
    manifolds.push_back(block->manifold);
    x0.emplace_back(block->x);
  }
  return window.add(std::make_unique<PriorTerm>(std::move(manifolds), std::move(x0), root), blocks);
}

void marginalize(Window& window, std::vector<const Block*> leaving, const std::vector<Walk>& walks) {
  std::vector<const Term*> terms;
  std::vector<Block*> touched;
  for (const auto& term : window.terms()) {
    const bool touches = std::any_of(term->blocks.begin(), term->blocks.end(),
                                     [&](const Block* block) { return contains(leaving, block); });
    if (!touches) continue;
    terms.push_back(term.get());
    touched.insert(touched.end(), term->blocks.begin(), term->blocks.end());
  }
  std::vector<const Block*> order = leaving;
  std::vector<Block*> kept;
  for (const auto& block : window.blocks()) {
    if (block->is_constant || contains(leaving, block.get()) ||
        std::find(touched.begin(), touched.end(), block.get()) == touched.end())
      continue;
    kept.push_back(block.get());
    order.push_back(block.get());
  }
  const SquareRoot known = eliminateFirst(linearize(order, terms), static_cast<int>(leaving.size()));
  Eigen::VectorXd gained = Eigen::VectorXd::Zero(known.J.cols());
  Eigen::Index first = 0;
  for (const Block* block : kept) {
    for (const Walk& walk : walks)
      if (walk.block == block) gained.segment(first + walk.first, walk.variance.size()) += walk.variance;
    first += block->manifold->tangent();
  }
  for (const Block* block : leaving) window.remove(*block);
  if (!kept.empty()) addPrior(window, kept, widened(known, gained));
}

}  // namespace rio_t
