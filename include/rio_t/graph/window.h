#pragma once

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>

#include <Eigen/Core>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "rio_t/core/time.h"
#include "rio_t/graph/manifold.h"

namespace rio_t {

class CeresManifold;

/// Parameters that the solver finds.
struct Block {
  Block(std::optional<Time> time_in, std::shared_ptr<const Manifold> manifold_in, const Eigen::VectorXd& x_in)
      : time(time_in),
        manifold(std::move(manifold_in)),
        storage(x_in.data(), x_in.data() + x_in.size()),
        x(storage.data(), x_in.size()) {}
  Block(const Block&) = delete;
  Block& operator=(const Block&) = delete;

  /// Time of a node. In a batch, the blocks of offsets and biases have a time, too, which orders them. Other
  /// calibration holds at all times and has none.
  std::optional<Time> time;
  std::shared_ptr<const Manifold> manifold;
  std::vector<double> storage;
  Eigen::Map<Eigen::VectorXd> x;                           ///< as stored; its address stays
  double bound = std::numeric_limits<double>::infinity();  ///< on |x| of a block of one number
  bool is_constant = false;                                ///< not solved for; set by Window::setConstant
  bool is_retired = false;                                 ///< calibration that no new term will use
};

/// A cost on some blocks.
struct Term {
  std::unique_ptr<ceres::CostFunction> cost;
  std::shared_ptr<ceres::LossFunction> loss;  ///< null: none
  std::vector<Block*> blocks;                 ///< in the order of the cost function
  std::optional<Time> stamp = {};             ///< of the scan that gave the term, if one did
  ceres::ResidualBlockId in_problem = nullptr;
};

/// A factor graph: blocks, and terms between them. One ceres::Problem lives as long as the window; terms and
/// blocks come and go in it. Not thread-safe.
class Window {
 public:
  Window();
  ~Window();
  Window(Window&&) noexcept;
  Window& operator=(Window&&) noexcept;

  Block& addNode(Time time, std::shared_ptr<const Manifold> manifold, const Eigen::VectorXd& x);
  /// Returns a shared pointer, so that the owner can ask later whether the window still has the block.
  std::shared_ptr<Block> addCalibration(std::shared_ptr<const Manifold> manifold, const Eigen::VectorXd& x);
  Term& add(std::unique_ptr<ceres::CostFunction> cost, std::vector<Block*> blocks,
            std::shared_ptr<ceres::LossFunction> loss = nullptr);
  void remove(const Term& term);
  /// Replaces the block `from` of the term by `to`.
  void exchange(Term& term, const Block& from, Block& to);
  /// Removes the block and the terms on it.
  void remove(const Block& block);
  void setConstant(Block& block, bool is_constant);
  bool has(const Block& block) const;

  /// In the order of elimination: nodes by their times, then calibration by its arrival.
  const std::vector<std::shared_ptr<Block>>& blocks() const { return blocks_; }
  const std::vector<std::unique_ptr<Term>>& terms() const { return terms_; }
  ceres::Problem& problem() { return *problem_; }

 private:
  std::shared_ptr<Block> insert(std::vector<std::shared_ptr<Block>>::iterator before,
                                std::shared_ptr<Block> added);
  void addToProblem(Term& term);

  // Declared before problem_, which refers to them.
  std::map<const Manifold*, std::unique_ptr<CeresManifold>> ceres_manifolds_;
  std::vector<std::shared_ptr<Block>> blocks_;
  std::vector<std::unique_ptr<Term>> terms_;
  std::unique_ptr<ceres::Problem> problem_;
};

}  // namespace rio_t
