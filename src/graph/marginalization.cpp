#include "rio_t/graph/marginalization.h"

#include <Eigen/LU>
#include <algorithm>
#include <utility>

namespace rio_t {
namespace {

/// A Jacobian as a cost function writes it.
using Stored = Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;

bool contains(const std::vector<const Block*>& blocks, const Block* block) {
  return std::find(blocks.begin(), blocks.end(), block) != blocks.end();
}

}  // namespace

PriorTerm::PriorTerm(std::vector<std::shared_ptr<const Manifold>> manifolds, std::vector<Eigen::VectorXd> x0,
                     SquareRoot root)
    : manifolds_(std::move(manifolds)), x0_(std::move(x0)), root_(std::move(root)) {
  set_num_residuals(static_cast<int>(root_.r0.size()));
  Eigen::Index first = 0;
  for (const auto& manifold : manifolds_) {
    mutable_parameter_block_sizes()->push_back(manifold->size());
    first_.push_back(first);
    first += manifold->tangent();
  }
  referPointsToNode();
}

void PriorTerm::referPointsToNode() {
  for (std::size_t i = 0; i < manifolds_.size(); ++i)
    if (manifolds_[i]->isPoint()) points_.push_back(i);
  if (points_.empty()) return;
  for (std::size_t i = 0; i < manifolds_.size() && !node_; ++i)
    if (manifolds_[i]->see(x0_[i].data(), x0_[points_.front()].data())) node_ = i;
  if (!node_) return points_.clear();
  const Manifold& node = *manifolds_[*node_];
  for (const std::size_t i : points_) {
    const PointFromNode seen = *node.see(x0_[*node_].data(), x0_[i].data());
    // d(seen) = J_node d(node) + J_point d(point). This replaces d(point) in the residual by d(seen).
    root_.J.middleCols<3>(first_[i]) *= seen.J_point.inverse();
    root_.J.middleCols(first_[*node_], node.tangent()) -= root_.J.middleCols<3>(first_[i]) * seen.J_node;
    x0_[i] = seen.p;
  }
}

bool PriorTerm::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  Eigen::Map<Eigen::VectorXd> r(residuals, num_residuals());
  r = root_.r0;
  for (std::size_t i = 0; i < manifolds_.size(); ++i) {
    const Manifold& manifold = *manifolds_[i];
    if (node_ && manifold.isPoint()) continue;
    const auto J = root_.J.middleCols(first_[i], manifold.tangent());
    r.noalias() += J * manifold.minus(parameters[i], x0_[i].data());
    if (jacobians == nullptr || jacobians[i] == nullptr) continue;
    Stored stored(jacobians[i], num_residuals(), manifold.size());
    const Eigen::MatrixXd tangent = J * manifold.minusJacobian(parameters[i], x0_[i].data());
    stored.setZero();
    for (int k = 0; k < manifold.tangent(); ++k) stored.col(manifold.columns()[k]) = tangent.col(k);
  }
  if (node_) addPoints(parameters, residuals, jacobians);
  return true;
}

void PriorTerm::addPoints(double const* const* parameters, double* residuals, double** jacobians) const {
  const Manifold& node = *manifolds_[*node_];
  Eigen::Map<Eigen::VectorXd> r(residuals, num_residuals());
  for (const std::size_t i : points_) {
    const auto J = root_.J.middleCols<3>(first_[i]);
    const PointFromNode seen = *node.see(parameters[*node_], parameters[i]);
    r.noalias() += J * (seen.p - x0_[i]);
    if (jacobians == nullptr) continue;
    if (jacobians[i] != nullptr) Stored(jacobians[i], num_residuals(), 3) = J * seen.J_point;
    if (jacobians[*node_] == nullptr) continue;
    Stored stored(jacobians[*node_], num_residuals(), node.size());
    const Eigen::MatrixXd tangent = J * seen.J_node;
    for (int k = 0; k < node.tangent(); ++k) stored.col(node.columns()[k]) += tangent.col(k);
  }
}

void addPrior(Window& window, const std::vector<Block*>& blocks, const SquareRoot& root) {
  std::vector<std::shared_ptr<const Manifold>> manifolds;
  std::vector<Eigen::VectorXd> x0;
  for (const Block* block : blocks) {
    manifolds.push_back(block->manifold);
    x0.emplace_back(block->x);
  }
  window.add(std::make_unique<PriorTerm>(std::move(manifolds), std::move(x0), root), blocks);
}

void addPrior(Window& window, Block& block, const Eigen::VectorXd& sigmas) {
  addPrior(window, {&block}, {sigmas.cwiseInverse().asDiagonal(), Eigen::VectorXd::Zero(sigmas.size())});
}

void marginalize(Window& window, std::vector<const Block*> leaving, const std::vector<Walk>& walks) {
  std::vector<const Term*> terms;
  std::vector<const Block*> touched;
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
    if (block->is_constant || contains(leaving, block.get()) || !contains(touched, block.get())) continue;
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
