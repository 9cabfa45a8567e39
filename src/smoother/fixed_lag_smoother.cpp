#include "rio_t/smoother/fixed_lag_smoother.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <utility>

#include "rio_t/factors/imu_factor.h"
#include "rio_t/factors/radar_motion.h"
#include "rio_t/factors/zero_velocity_factor.h"

namespace rio_t {

StateBlock stateOf(const Block& motion, const Block& biases) {
  StateBlock x;
  std::copy_n(motion.x.data(), StateBlock::kMotion, x.data());
  std::copy_n(biases.x.data(), StateBlock::kBiases, x.data() + StateBlock::kMotion);
  return x;
}

Eigen::VectorXd storedMotion(const StateBlock& x) {
  return Eigen::Map<const Eigen::VectorXd>(x.data(), StateBlock::kMotion);
}

Eigen::VectorXd storedBiases(const StateBlock& x) {
  return Eigen::Map<const Eigen::VectorXd>(x.biases(), StateBlock::kBiases);
}

FixedLagSmoother::FixedLagSmoother(const SmootherOptions& options, const ImuNoise& noise,
                                   const Eigen::Vector3d& g_W, const ImuBuffer& imu)
    : options_(options),
      noise_(noise),
      g_W_(g_W),
      imu_(&imu),
      motion_manifold_(std::make_shared<MotionManifold>()),
      bias_manifold_(std::make_shared<VectorManifold>(StateBlock::kBiases)) {}

void FixedLagSmoother::setImuNoise(const ImuNoise& noise) {
  noise_ = noise;
  last_preintegration_ = {};
}

Block& FixedLagSmoother::start(Time time, const StateBlock& x0) {
  window_ = Window();
  Block& block = window_.addNode(time, motion_manifold_, storedMotion(x0));
  biases_ = window_.addCalibration(bias_manifold_, storedBiases(x0));
  nodes_ = {Node{&block}};
  drifted_ = 0.0;
  solution_ = Solution();
  return block;
}

NodeEstimate FixedLagSmoother::node(std::size_t k) const {
  return {nodes_[k].time(), stateOf(*nodes_[k].motion, *biases_)};
}

std::vector<NodeEstimate> FixedLagSmoother::nodes() const {
  std::vector<NodeEstimate> nodes;
  nodes.reserve(size());
  for (std::size_t k = 0; k < size(); ++k) nodes.push_back(node(k));
  return nodes;
}

std::size_t FixedLagSmoother::indexBefore(Time time) const {
  std::size_t k = nodes_.size() - 1;
  while (k > 0 && nodes_[k].time() > time) --k;
  return k;
}

std::optional<NodeEstimate> FixedLagSmoother::nodeBefore(Time time) const {
  if (time < nodes_.front().time()) return std::nullopt;
  return node(indexBefore(time));
}

Eigen::VectorXd biasWalkVariance(const ImuNoise& noise, double dt) {
  Eigen::VectorXd variance(StateBlock::kBiases);
  variance << Eigen::Vector3d::Constant(noise.gyro_random_walk * noise.gyro_random_walk * dt),
      Eigen::Vector3d::Constant(noise.accel_random_walk * noise.accel_random_walk * dt);
  return variance;
}

Eigen::MatrixXd FixedLagSmoother::covarianceOf(const Block& node,
                                               const std::vector<const Block*>& calibration) const {
  std::vector<int> indices = {solution_.system.indexOf(node), solution_.system.indexOf(*biases_)};
  for (const Block* block : calibration) indices.push_back(solution_.system.indexOf(*block));
  if (std::any_of(indices.begin(), indices.end(), [](int i) { return i < 0; }))
    throw std::logic_error("smoother: asked for the covariance of what was not solved for");
  return solution_.elimination.covariance(indices);
}

Eigen::MatrixXd FixedLagSmoother::newestCovariance(const std::vector<const Block*>& calibration) const {
  return covarianceOf(*nodes_.back().motion, calibration);
}

std::optional<PredictedState> FixedLagSmoother::predict(Time time,
                                                        const std::vector<const Block*>& calibration) const {
  if (time < nodes_.front().time()) return std::nullopt;
  const Node& node = nodes_[indexBefore(time)];
  PredictedState predicted{stateOf(*node.motion, *biases_), covarianceOf(*node.motion, calibration)};
  if (time == node.time()) return predicted;
  const Preintegration& pre = preintegrateFrom(node, time);
  const ImuTransition step = transition(predicted.x, pre);
  predicted.x = rio_t::predict(predicted.x, pre.delta, g_W_);
  constexpr int kMotion = StateBlock::kMotionTangent, kState = StateBlock::kTangent;
  Eigen::MatrixXd& P = predicted.covariance;
  P.topRows<kMotion>() = (step.A * P.topRows<kState>()).eval();
  P.leftCols<kMotion>() = (P.leftCols<kState>() * step.A.transpose()).eval();
  P.topLeftCorner<kMotion, kMotion>() += step.Q;
  return predicted;
}

double minNodeSpacing(TimeOffsetModel model) {
  // The factor of the imu model integrates from node to scan. That of the other model does not, which costs
  // up to 1 cm/s. With a spacing of 0.1 ms, rounding made the sigma of the position a third too small.
  return model == TimeOffsetModel::kImu ? 0.005 : 0.001;
}

Block* FixedLagSmoother::nodeAt(Time time) {
  if (time < nodes_.front().time()) return nullptr;
  const double spacing = minNodeSpacing(options_.time_offset_model);
  const std::size_t before = indexBefore(time);
  const std::size_t after = before + 1;
  if (time - nodes_[before].time() <= spacing) return nodes_[before].motion;
  if (after < nodes_.size() && nodes_[after].time() - time <= spacing) return nodes_[after].motion;

  const StateBlock x = rio_t::predict(node(before).x, preintegrateFrom(nodes_[before], time).delta, g_W_);
  Block& block = window_.addNode(time, motion_manifold_, storedMotion(x));
  nodes_.insert(nodes_.begin() + static_cast<std::ptrdiff_t>(after), Node{&block});
  linkToPrevious(after);
  if (after + 1 < nodes_.size()) linkToPrevious(after + 1);  // its IMU factor now starts at the new node
  return &block;
}

void FixedLagSmoother::addCalibrationPrior(std::vector<Block*> calibration, const Eigen::VectorXd& sigmas) {
  calibration.insert(calibration.begin(), nodes_.back().motion);
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(sigmas.size(), StateBlock::kMotionTangent + sigmas.size());
  J.rightCols(sigmas.size()) = sigmas.cwiseInverse().asDiagonal();
  addPrior(window_, calibration, {J, Eigen::VectorXd::Zero(sigmas.size())});
}

void FixedLagSmoother::linkToPrevious(std::size_t k) {
  Node& node = nodes_[k];
  const Node& previous = nodes_[k - 1];
  if (node.imu_from_previous != nullptr) window_.remove(*node.imu_from_previous);
  node.imu_from_previous =
      &window_.add(std::make_unique<ImuFactor>(preintegrateFrom(previous, node.time()), g_W_),
                   {previous.motion, node.motion, biases_.get()});
}

void FixedLagSmoother::addZeroVelocity(Block& node, double velocity_sigma) {
  const auto at =
      std::find_if(nodes_.begin(), nodes_.end(), [&](const Node& n) { return n.motion == &node; });
  if (at->zero_velocity != nullptr) window_.remove(*at->zero_velocity);
  at->zero_velocity = &window_.add(std::make_unique<ZeroVelocityFactor>(velocity_sigma), {&node});
}

const Preintegration& FixedLagSmoother::preintegrateFrom(const Node& node, Time to) const {
  LastPreintegration& last = last_preintegration_;
  const StateView x(node.motion->x.data(), biases_->x.data());
  if (last.from != node.time() || last.to != to || last.value.b_g != x.b_g || last.value.b_a != x.b_a)
    last = {node.time(), to, preintegrate(*imu_, node.time(), to, x.b_g, x.b_a, noise_)};
  return last.value;
}

const Solution& FixedLagSmoother::optimize() {
  solution_ = solve(window_, {options_.max_iterations}, options_.solver);
  return solution_;
}

std::vector<const Block*> FixedLagSmoother::leavingWith(const Block& node) const {
  std::vector<const Block*> leaving = {&node};
  for (const auto& block : window_.blocks()) {
    if (!block->is_retired) continue;
    const bool is_linked_to_others =
        std::any_of(window_.terms().begin(), window_.terms().end(), [&](const auto& term) {
          const auto& blocks = term->blocks;
          return std::find(blocks.begin(), blocks.end(), block.get()) != blocks.end() &&
                 std::any_of(blocks.begin(), blocks.end(),
                             [&](const Block* b) { return b->time && b != &node; });
        });
    if (!is_linked_to_others) leaving.push_back(block.get());
  }
  return leaving;
}

std::vector<NodeEstimate> FixedLagSmoother::marginalize(const std::vector<RandomWalk>& walks) {
  std::vector<NodeEstimate> left;
  while (nodes_.size() > 2 && nodes_.back().time() - nodes_.front().time() > options_.window) {
    const double dt = nodes_[1].time() - nodes_[0].time();
    std::vector<Walk> gained;
    gained.push_back({biases_.get(), biasWalkVariance(noise_, dt)});
    for (const RandomWalk& walk : walks) gained.push_back({walk.block, walk.density.cwiseAbs2() * dt});
    if (drifted_ > 0.0)
      gained.push_back(
          {nodes_[1].motion, Eigen::Vector3d::Constant(std::exchange(drifted_, 0.0)), StateBlock::kP});
    left.push_back(node(0));
    rio_t::marginalize(window_, leavingWith(*nodes_.front().motion), gained);
    nodes_.erase(nodes_.begin());
    nodes_.front().imu_from_previous = nullptr;
  }
  return left;
}

Time FixedLagSmoother::imuNeededSince() const {
  // The time of measurement is within max_time_offset of the stamp, and the stamp is within it of the node.
  return nodes_.front().time() - (2.0 * options_.max_time_offset + kMaxOffsetHalfWidth);
}

}  // namespace rio_t
