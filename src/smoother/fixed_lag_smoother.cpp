#include "rio_t/smoother/fixed_lag_smoother.h"

#include <ceres/problem.h>
#include <ceres/solver.h>

#include <algorithm>
#include <cmath>

namespace rio_t {
namespace {

/// Nodes of the imu model nearer than this share one node [s]: the factor bridges the rest, and an IMU factor over
/// no time would weigh infinitely.
constexpr double kMinNodeSpacing = 0.005;

ceres::Problem::Options borrowingProblem() {
  ceres::Problem::Options options;
  options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
#if RIO_T_CERES_HAS_MANIFOLD
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
#else
  options.local_parameterization_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
#endif
  options.disable_all_safety_checks = true;
  return options;
}

}  // namespace

FixedLagSmoother::FixedLagSmoother(const SmootherOptions& options, const ImuNoise& noise, const Eigen::Vector3d& g_W,
                                   const ImuBuffer& imu)
    : options_(options), noise_(noise), g_W_(g_W), imu_(&imu) {
  if (options_.huber_threshold > 0.0) loss_ = std::make_unique<ceres::HuberLoss>(options_.huber_threshold);
}

void FixedLagSmoother::initialize(Time time, const StateBlock& x) {
  NodePrior prior;
  prior.x0 = x;
  prior.t_O0 = options_.time_offset_initial;
  const Eigen::Vector3d sigma_W(options_.prior_sigma_orientation, options_.prior_sigma_orientation,
                                options_.prior_sigma_yaw);
  // theta lives in I, the sigmas are given in W.
  prior.J.block<3, 3>(StateBlock::kTheta, StateBlock::kTheta) =
      sigma_W.cwiseInverse().asDiagonal() * x.q_WI().toRotationMatrix();
  const auto set = [&](int first, double sigma) { prior.J.diagonal().segment<3>(first).setConstant(1.0 / sigma); };
  set(StateBlock::kP, options_.prior_sigma_position);
  set(StateBlock::kV, options_.prior_sigma_velocity);
  set(StateBlock::kBg, options_.prior_sigma_gyro_bias);
  set(StateBlock::kBa, options_.prior_sigma_accel_bias);
  prior.J(StateBlock::kTangent, StateBlock::kTangent) = 1.0 / options_.time_offset_sigma;
  prior_ = std::make_unique<PriorFactor>(prior);

  nodes_.clear();
  Node node;
  node.time = time;
  node.x = x;
  node.t_O = options_.time_offset_initial;
  nodes_.push_back(std::move(node));
}

Time FixedLagSmoother::nodeTime(Time stamp) const {
  return options_.time_offset_model == TimeOffsetModel::kImu ? stamp - nodes_.back().t_O : stamp;
}

FixedLagSmoother::AddResult FixedLagSmoother::add(const RadarVelocityMeasurement& z) {
  for (const Node& node : nodes_) {
    for (const RadarTerm& term : node.radar) {
      if (term.stamp == z.stamp) return AddResult::kDuplicateStamp;
    }
  }
  const Time time = nodeTime(z.stamp);
  const auto later =
      std::find_if(nodes_.begin(), nodes_.end(), [&](const Node& node) { return node.time > time; });
  if (later == nodes_.begin()) return AddResult::kOlderThanWindow;

  // The factor of the imu model reaches its time of measurement from any node, so neighbours can share one.
  const double spacing = options_.time_offset_model == TimeOffsetModel::kImu ? kMinNodeSpacing : 0.0;
  std::size_t k = static_cast<std::size_t>(later - nodes_.begin());
  if (time - nodes_[k - 1].time <= spacing) {
    k = k - 1;
  } else if (k == nodes_.size() || nodes_[k].time - time > spacing) {
    nodes_.insert(later, makeNode(time, nodes_[k - 1]));
    linkToPrevious(k);
    if (k + 1 < nodes_.size()) linkToPrevious(k + 1);  // its IMU factor now starts at the new node
  }
  nodes_[k].radar.push_back({z.stamp, makeRadarFactor(z, nodes_[k].time)});
  return AddResult::kAdded;
}

FixedLagSmoother::Node FixedLagSmoother::makeNode(Time time, const Node& previous) const {
  Node node;
  node.time = time;
  node.x = predict(previous.x, preintegrate(*imu_, previous.time, time, previous.x.b_g(), previous.x.b_a(), noise_),
                   g_W_);
  node.t_O = previous.t_O;
  return node;
}

void FixedLagSmoother::linkToPrevious(std::size_t k) {
  const Node& previous = nodes_[k - 1];
  Node& node = nodes_[k];
  node.imu_from_previous = std::make_unique<ImuFactor>(
      preintegrate(*imu_, previous.time, node.time, previous.x.b_g(), previous.x.b_a(), noise_), noise_, g_W_);
  node.offset_from_previous = std::make_unique<ConstantOffsetFactor>(options_.time_offset_noise *
                                                                     std::sqrt(node.time - previous.time));
}

std::unique_ptr<ceres::CostFunction> FixedLagSmoother::makeRadarFactor(const RadarVelocityMeasurement& z,
                                                                       Time node_time) const {
  if (options_.time_offset_model == TimeOffsetModel::kImu) {
    return std::make_unique<ImuRadarFactor>(z, node_time, *imu_, options_.max_time_offset, g_W_);
  }
  return std::make_unique<ConstantAccelerationRadarFactor>(z, imu_->at(z.stamp), g_W_);
}

SolveReport FixedLagSmoother::optimize() {
  ceres::Problem problem(borrowingProblem());
  for (Node& node : nodes_) {
    addStateBlock(problem, node.x.data(), manifold_);
    problem.AddParameterBlock(&node.t_O, 1);
    if (!options_.estimate_time_offset) problem.SetParameterBlockConstant(&node.t_O);
  }
  problem.AddResidualBlock(prior_.get(), nullptr, nodes_.front().x.data(), &nodes_.front().t_O);
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    Node& node = nodes_[k];
    for (const RadarTerm& term : node.radar) {
      problem.AddResidualBlock(term.cost.get(), loss_.get(), node.x.data(), &node.t_O);
    }
    if (k == 0) continue;
    problem.AddResidualBlock(node.imu_from_previous.get(), nullptr, nodes_[k - 1].x.data(), node.x.data());
    problem.AddResidualBlock(node.offset_from_previous.get(), nullptr, &nodes_[k - 1].t_O, &node.t_O);
  }

  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = options_.max_iterations;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);

  for (Node& node : nodes_) node.t_O = std::clamp(node.t_O, -options_.max_time_offset, options_.max_time_offset);
  return {static_cast<int>(summary.iterations.size()), summary.termination_type == ceres::CONVERGENCE};
}

ChainSystem FixedLagSmoother::linearize(std::size_t count) const {
  ChainSystem system(count);
  const bool offset_known = !options_.estimate_time_offset;
  system.addStateAndOffset(0, *prior_, nodes_[0].x.data(), &nodes_[0].t_O, nullptr, false);
  for (std::size_t k = 0; k < count; ++k) {
    const Node& node = nodes_[k];
    for (const RadarTerm& term : node.radar) {
      system.addStateAndOffset(k, *term.cost, node.x.data(), &node.t_O, loss_.get(), offset_known);
    }
    if (k == 0) continue;
    system.addStatePair(k - 1, *node.imu_from_previous, nodes_[k - 1].x.data(), node.x.data());
    system.addOffsetPair(k - 1, *node.offset_from_previous, &nodes_[k - 1].t_O, &node.t_O);
  }
  return system;
}

std::vector<NodeEstimate> FixedLagSmoother::marginalize() {
  std::vector<NodeEstimate> left;
  while (nodes_.size() > 2 && nodes_.back().time - nodes_.front().time > options_.window) {
    // Only the factors that touch the leaving node; the radar factors of its neighbour stay in the window.
    ChainSystem system(2);
    const Node& first = nodes_[0];
    const Node& second = nodes_[1];
    system.addStateAndOffset(0, *prior_, first.x.data(), &first.t_O, nullptr, false);
    for (const RadarTerm& term : first.radar) {
      system.addStateAndOffset(0, *term.cost, first.x.data(), &first.t_O, loss_.get(), !options_.estimate_time_offset);
    }
    system.addStatePair(0, *second.imu_from_previous, first.x.data(), second.x.data());
    system.addOffsetPair(0, *second.offset_from_previous, &first.t_O, &second.t_O);
    const NodeInformation remaining = eliminateFirst(system.diagonal[0], system.coupling[0], system.gradient[0],
                                                     system.diagonal[1], system.gradient[1]);
    prior_ = std::make_unique<PriorFactor>(priorFromInformation(remaining, second.x, second.t_O));

    left.push_back(node(0));
    nodes_.pop_front();
    nodes_.front().imu_from_previous.reset();
    nodes_.front().offset_from_previous.reset();
  }
  return left;
}

NodeMatrix FixedLagSmoother::newestCovariance() const { return covarianceOfLast(linearize(nodes_.size())); }

Time FixedLagSmoother::imuNeededSince() const {
  // Offsets move a radar factor's time by at most the bound to either side of its stamp, and the stamp lies within
  // the bound of the node.
  return nodes_.front().time - 2.0 * options_.max_time_offset;
}

}  // namespace rio_t
