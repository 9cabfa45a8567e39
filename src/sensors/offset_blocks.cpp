#include "rio_t/sensors/offset_blocks.h"

#include <algorithm>
#include <utility>

#include "rio_t/factors/random_walk_factor.h"

namespace rio_t {

OffsetBlocks::OffsetBlocks(const SmootherOptions& options, const CalibrationPrior& radar)
    : options_(options), radar_(radar), manifold_(std::make_shared<VectorManifold>(1)) {}

Block& OffsetBlocks::start(Window& window, double t_O) {
  epochs_ = {{Time(), add(window, t_O)}};
  return *epochs_.back().block;
}

std::shared_ptr<Block> OffsetBlocks::add(Window& window, double t_O) const {
  std::shared_ptr<Block> block = window.addCalibration(manifold_, Eigen::VectorXd::Constant(1, t_O));
  block->bound = options_.max_time_offset;
  if (!options_.estimate_time_offset) window.setConstant(*block, true);
  return block;
}

OffsetBlocks::OfScan OffsetBlocks::of(Window& window, Time stamp) {
  const auto is_gone = [&](const Epoch& epoch) { return !window.has(*epoch.block); };
  epochs_.erase(std::remove_if(epochs_.begin(), epochs_.end() - 1, is_gone), epochs_.end() - 1);
  auto epoch = epochs_.end() - 1;
  while (epoch != epochs_.begin() && stamp < epoch->since) --epoch;

  const auto has_left = [](const Scan& scan) { return scan.linear_from.expired(); };
  scans_.erase(std::remove_if(scans_.begin(), scans_.end(), has_left), scans_.end());
  const auto linear_from = std::make_shared<double>(epoch->block->x[0]);
  scans_.push_back({stamp, linear_from});
  return {epoch->block.get(), linear_from};
}

void OffsetBlocks::step(FixedLagSmoother& smoother, const OffsetStep& step, Time covered) {
  ++steps_;
  Window& window = smoother.window();
  Block& before = *epochs_.back().block;
  std::shared_ptr<Block> after = add(window, value() + step.change);
  window.add(std::make_unique<RandomWalkFactor>(Eigen::VectorXd::Constant(1, radar_.time_offset_sigma)),
             {&before, after.get()});
  // The scans since the step have pulled velocity and biases with the old offset. From now on they use the
  // new one.
  for (const auto& term : window.terms()) {
    const bool uses_it = std::find(term->blocks.begin(), term->blocks.end(), &before) != term->blocks.end();
    if (uses_it && term->stamp && *term->stamp >= step.first) window.exchange(*term, before, *after);
  }
  for (const Scan& scan : scans_) {
    const auto linear_from = scan.linear_from.lock();
    if (linear_from && scan.stamp >= step.first) *linear_from = std::max(after->x[0], scan.stamp - covered);
  }
  before.is_retired = true;
  epochs_.push_back({step.first, std::move(after)});
  smoother.settle();
}

}  // namespace rio_t
