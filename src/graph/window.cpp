#include "rio_t/graph/window.h"

#include <algorithm>
#include <utility>

#include "ceres_manifold.h"

namespace rio_t {
namespace {

ceres::Problem::Options problemOptions() {
  ceres::Problem::Options options;
  options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
#if RIO_T_CERES_HAS_MANIFOLD
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
#else
  options.local_parameterization_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
#endif
  options.enable_fast_removal = true;
  options.disable_all_safety_checks = true;
  return options;
}

}  // namespace

Window::Window() : problem_(std::make_unique<ceres::Problem>(problemOptions())) {}
Window::~Window() = default;
Window::Window(Window&&) noexcept = default;
Window& Window::operator=(Window&&) noexcept = default;

Block& Window::addNode(Time time, std::shared_ptr<const Manifold> manifold, const Eigen::VectorXd& x) {
  const auto later = std::find_if(blocks_.rbegin(), blocks_.rend(), [&](const auto& block) {
                       return block->time && *block->time <= time;
                     }).base();
  return *insert(later, std::make_shared<Block>(time, std::move(manifold), x));
}

std::shared_ptr<Block> Window::addCalibration(std::shared_ptr<const Manifold> manifold,
                                              const Eigen::VectorXd& x) {
  return insert(blocks_.end(), std::make_shared<Block>(std::nullopt, std::move(manifold), x));
}

std::shared_ptr<Block> Window::insert(std::vector<std::shared_ptr<Block>>::iterator before,
                                      std::shared_ptr<Block> added) {
  blocks_.insert(before, added);
  const Manifold& manifold = *added->manifold;
  if (manifold.size() == manifold.tangent()) {
    problem_->AddParameterBlock(added->x.data(), manifold.size());
  } else {
    auto& adapter = ceres_manifolds_[&manifold];
    if (!adapter) adapter = std::make_unique<CeresManifold>(manifold);
    problem_->AddParameterBlock(added->x.data(), manifold.size(), adapter.get());
  }
  return added;
}

Term& Window::add(std::unique_ptr<ceres::CostFunction> cost, std::vector<Block*> blocks,
                  std::shared_ptr<ceres::LossFunction> loss) {
  auto term = std::make_unique<Term>();
  term->cost = std::move(cost);
  term->loss = std::move(loss);
  term->blocks = std::move(blocks);
  addToProblem(*term);
  terms_.push_back(std::move(term));
  return *terms_.back();
}

void Window::addToProblem(Term& term) {
  std::vector<double*> parameters;
  for (Block* block : term.blocks) parameters.push_back(block->x.data());
  term.in_problem = problem_->AddResidualBlock(term.cost.get(), term.loss.get(), parameters);
}

void Window::remove(const Term& term) {
  const auto at =
      std::find_if(terms_.begin(), terms_.end(), [&](const auto& other) { return other.get() == &term; });
  problem_->RemoveResidualBlock(term.in_problem);
  terms_.erase(at);
}

void Window::exchange(Term& term, const Block& from, Block& to) {
  for (Block*& block : term.blocks)
    if (block == &from) block = &to;
  problem_->RemoveResidualBlock(term.in_problem);
  addToProblem(term);
}

void Window::remove(const Block& block) {
  const auto touches = [&](const std::unique_ptr<Term>& term) {
    return std::find(term->blocks.begin(), term->blocks.end(), &block) != term->blocks.end();
  };
  // Ceres would remove these terms in the order of their addresses. Then the order of the other terms, and
  // the rounding of every sum, would depend on the addresses.
  for (const auto& term : terms_)
    if (touches(term)) problem_->RemoveResidualBlock(term->in_problem);
  terms_.erase(std::remove_if(terms_.begin(), terms_.end(), touches), terms_.end());
  const auto at =
      std::find_if(blocks_.begin(), blocks_.end(), [&](const auto& other) { return other.get() == &block; });
  problem_->RemoveParameterBlock((*at)->x.data());
  blocks_.erase(at);
}

bool Window::has(const Block& block) const {
  return std::any_of(blocks_.begin(), blocks_.end(),
                     [&](const auto& other) { return other.get() == &block; });
}

void Window::setConstant(Block& block, bool is_constant) {
  block.is_constant = is_constant;
  if (is_constant) {
    problem_->SetParameterBlockConstant(block.x.data());
  } else {
    problem_->SetParameterBlockVariable(block.x.data());
  }
}

}  // namespace rio_t
