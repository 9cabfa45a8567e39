#include "rio_t/smoother/fixed_lag_smoother.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rio_t/factors/offset_derivative.h"
#include "rio_t/smoother/chain_marginals.h"

namespace rio_t {
namespace {

/// Nodes of the imu model nearer than this share one node [s]: the factor bridges the rest, and an IMU factor
/// over no time would weigh infinitely.
constexpr double kMinNodeSpacing = 0.005;

}  // namespace

FixedLagSmoother::FixedLagSmoother(const SmootherOptions& options, const ImuNoise& noise,
                                   const Eigen::Vector3d& g_W, const ImuBuffer& imu)
    : options_(options), noise_(noise), g_W_(g_W), imu_(&imu), pool_(options, noise, g_W, imu) {
  window_.offset_known = !options_.estimate_time_offset;
  window_.max_time_offset = options_.max_time_offset;
  if (options_.huber_threshold > 0.0)
    window_.loss = std::make_unique<ceres::HuberLoss>(options_.huber_threshold);
}

void FixedLagSmoother::setImuNoise(const ImuNoise& noise) {
  noise_ = noise;
  last_preintegration_ = {};
}

void FixedLagSmoother::initialize(Time time, const NodePrior& prior) {
  window_.prior = std::make_unique<PriorFactor>(prior);
  window_.nodes.clear();
  WindowNode node = pool_.node();
  node.time = time;
  node.x = prior.x0;
  node.t_O = prior.t_O0;
  window_.nodes.push_back(std::move(node));
  newest_covariance_ = rio_t::newestCovariance(window_);
  offset_stepped_at_.reset();
  offset_step_is_new_ = false;
}

Time FixedLagSmoother::nodeTime(Time stamp) const {
  return options_.time_offset_model == TimeOffsetModel::kImu ? stamp - window_.nodes.back().t_O : stamp;
}

std::size_t FixedLagSmoother::nodeBefore(Time time) const {
  std::size_t k = window_.nodes.size() - 1;
  while (k > 0 && window_.nodes[k].time > time) --k;
  return k;
}

NodeMatrix FixedLagSmoother::covarianceOf(std::size_t k) const {
  if (k + 1 == window_.nodes.size()) return newest_covariance_;
  ChainSystem system;
  linearize(window_, &system);
  return marginalCovariances(system)[k];
}

std::optional<RadarVelocityPrediction> FixedLagSmoother::predictRadarVelocity(
    Time stamp, const Eigen::Matrix3d& R_RI, const Eigen::Vector3d& l_I) const {
  const Time time = nodeTime(stamp);
  if (time < window_.nodes.front().time) return std::nullopt;
  const std::size_t k = nodeBefore(time);
  const WindowNode& node = window_.nodes[k];

  StateBlock x = node.x;
  NodeMatrix P = covarianceOf(k);
  if (time > node.time) {
    const Preintegration& pre = preintegrateFrom(node, time);
    x = predict(node.x, pre, g_W_);
    const ImuTransition step = transition(node.x, pre, noise_);
    auto P_xx = P.topLeftCorner<StateBlock::kTangent, StateBlock::kTangent>();
    auto P_xt = P.topRightCorner<StateBlock::kTangent, 1>();
    P_xx = (step.A.lazyProduct(P_xx).eval().lazyProduct(step.A.transpose()) + step.Q).eval();
    P_xt = (step.A * P_xt).eval();
    P.bottomLeftCorner<1, StateBlock::kTangent>() = P_xt.transpose();
    P(StateBlock::kTangent, StateBlock::kTangent) += offsetVariance(time - node.time);
  }

  // A measurement of zero with unit covariance has the predicted velocity as its residual.
  RadarVelocityMeasurement zero;
  zero.stamp = stamp;
  zero.R_RI = R_RI;
  zero.l_I = l_I;
  RadarVelocityPrediction prediction;
  // The offset of the newest node, by which the scan was placed.
  prediction.t_O = window_.nodes.back().t_O;
  const double* blocks[] = {x.data(), &prediction.t_O};
  StateJacobian<3> J_x;
  Eigen::Vector3d J_t;
  double* jacobians[] = {J_x.data(), J_t.data()};
  std::unique_ptr<RadarCost> factor = pool_.radarFactor(zero, time);
  factor->Evaluate(blocks, prediction.velocity.v_R.data(), jacobians);
  pool_.recycle(std::move(factor));
  Eigen::Matrix<double, 3, kNodeTangent> J;
  J << J_x.leftCols<3>(), J_x.rightCols<StateBlock::kTangent - 3>(), J_t;
  if (!options_.estimate_time_offset) J.rightCols<1>().setZero();
  prediction.velocity.covariance = J * P * J.transpose();
  const auto J_state = J.leftCols<StateBlock::kTangent>();
  prediction.covariance_at_offset =
      J_state * P.topLeftCorner<StateBlock::kTangent, StateBlock::kTangent>() * J_state.transpose();
  prediction.dv_dt_O = J_t;
  const VelocityRate rate = velocityRate(*imu_, time, x, g_W_, l_I);
  prediction.informs_offset = rate.informsOffset(options_.time_offset_min_acceleration);
  prediction.rate_variance = rate.variance * P(StateBlock::kTangent, StateBlock::kTangent);
  const Eigen::Matrix<double, 2, 3> horizontal = x.q_WI().toRotationMatrix().topRows<2>();
  const Eigen::Matrix2d tilt =
      horizontal * P.block<3, 3>(StateBlock::kTheta, StateBlock::kTheta) * horizontal.transpose();
  prediction.tilt_sigma = std::sqrt(tilt.diagonal().maxCoeff());
  return prediction;
}

FixedLagSmoother::AddResult FixedLagSmoother::add(const RadarVelocityMeasurement& z) {
  for (const WindowNode& node : window_.nodes) {
    for (const RadarTerm& term : node.radar) {
      if (term.stamp == z.stamp) return AddResult::kDuplicateStamp;
    }
  }
  WindowNode* node = nodeOf(z.stamp);
  if (node == nullptr) return AddResult::kOlderThanWindow;
  node->radar.push_back({z.stamp, pool_.radarFactor(z, node->time)});
  return AddResult::kAdded;
}

FixedLagSmoother::AddResult FixedLagSmoother::addRest(Time stamp, double velocity_sigma) {
  WindowNode* node = nodeOf(stamp);
  if (node == nullptr) return AddResult::kOlderThanWindow;
  pool_.recycle(std::move(node->rest));
  node->rest = pool_.zeroVelocityFactor(velocity_sigma);
  return AddResult::kAdded;
}

WindowNode* FixedLagSmoother::nodeAt(Time time) {
  const auto later = std::find_if(window_.nodes.begin(), window_.nodes.end(),
                                  [&](const WindowNode& node) { return node.time > time; });
  if (later == window_.nodes.begin()) return nullptr;

  // The factor of the imu model reaches its time of measurement from any node, so neighbours can share one.
  const double spacing = options_.time_offset_model == TimeOffsetModel::kImu ? kMinNodeSpacing : 0.0;
  std::size_t k = static_cast<std::size_t>(later - window_.nodes.begin());
  if (time - window_.nodes[k - 1].time <= spacing) {
    k = k - 1;
  } else if (k == window_.nodes.size() || window_.nodes[k].time - time > spacing) {
    window_.nodes.insert(later, makeNode(time, window_.nodes[k - 1]));
    linkToPrevious(k);
    if (k + 1 < window_.nodes.size()) linkToPrevious(k + 1);  // its IMU factor now starts at the new node
  }
  return &window_.nodes[k];
}

WindowNode* FixedLagSmoother::nodeOf(Time stamp) {
  WindowNode* node = nodeAt(nodeTime(stamp));
  if (node != nullptr && offset_stepped_at_ && stamp >= *offset_stepped_at_) {
    placeOffsetStep(static_cast<std::size_t>(node - window_.nodes.data()));
  }
  return node;
}

/// A scan behind the step may have been measured before nodes that the old offset placed: the step then lies
/// before it, too.
void FixedLagSmoother::placeOffsetStep(std::size_t k) {
  std::vector<WindowNode>& nodes = window_.nodes;
  const auto loose = std::find_if(nodes.begin() + 1, nodes.end(),
                                  [](const WindowNode& node) { return node.offset_step_variance > 0.0; });
  const bool lies_before = loose != nodes.end() && loose - nodes.begin() <= static_cast<std::ptrdiff_t>(k);
  if (k == 0 || lies_before || (loose == nodes.end() && !offset_step_is_new_)) return;
  offset_step_is_new_ = false;
  if (loose != nodes.end()) {
    loose->offset_step_variance = 0.0;
    linkToPrevious(static_cast<std::size_t>(loose - nodes.begin()));
  }
  nodes[k].offset_step_variance = options_.time_offset_sigma * options_.time_offset_sigma;
  linkToPrevious(k);
}

WindowNode FixedLagSmoother::makeNode(Time time, const WindowNode& previous) {
  WindowNode node = pool_.node();
  node.time = time;
  node.x = predict(previous.x, preintegrateFrom(previous, time), g_W_);
  node.t_O = previous.t_O;
  return node;
}

void FixedLagSmoother::linkToPrevious(std::size_t k) {
  const WindowNode& previous = window_.nodes[k - 1];
  WindowNode& node = window_.nodes[k];
  pool_.recycle(std::move(node.imu_from_previous));
  pool_.recycle(std::move(node.offset_from_previous));
  node.imu_from_previous = pool_.imuFactor(preintegrateFrom(previous, node.time));
  node.offset_from_previous =
      pool_.offsetFactor(std::sqrt(offsetVariance(node.time - previous.time) + node.offset_step_variance));
}

const Preintegration& FixedLagSmoother::preintegrateFrom(const WindowNode& node, Time to) const {
  LastPreintegration& last = last_preintegration_;
  if (last.from != node.time || last.to != to || last.value.b_g != node.x.b_g() ||
      last.value.b_a != node.x.b_a()) {
    last = {node.time, to, preintegrate(*imu_, node.time, to, node.x.b_g(), node.x.b_a(), noise_)};
  }
  return last.value;
}

double FixedLagSmoother::offsetVariance(double dt) const {
  return options_.time_offset_noise * options_.time_offset_noise * dt;
}

SolveReport FixedLagSmoother::optimize(double short_step) {
  const SolverLimits limits{options_.max_iterations, short_step};
  if (options_.solver == WindowSolverKind::kCeres) {
    const SolveReport report = solveWithCeres(window_, limits);
    newest_covariance_ = rio_t::newestCovariance(window_);
    return report;
  }
  const SolveReport report = solver_.solve(window_, limits);
  newest_covariance_ = solver_.newestCovariance();
  return report;
}

const std::vector<NodeEstimate>& FixedLagSmoother::marginalize() {
  left_.clear();
  while (window_.nodes.size() > 2 &&
         window_.nodes.back().time - window_.nodes.front().time > options_.window) {
    // Only the factors that touch the leaving node; the radar factors of its neighbour stay in the window.
    ChainSystem& system = leaving_;
    system.reset(2);
    const WindowNode& first = window_.nodes[0];
    const WindowNode& second = window_.nodes[1];
    system.addStateAndOffset(0, *window_.prior, first.x.data(), &first.t_O, nullptr, false);
    for (const RadarTerm& term : first.radar) {
      system.addStateAndOffset(0, *term.cost, first.x.data(), &first.t_O, window_.loss.get(),
                               !options_.estimate_time_offset);
    }
    if (first.rest) system.addState(0, *first.rest, first.x.data());
    system.addStatePair(0, *second.imu_from_previous, first.x.data(), second.x.data());
    system.addOffsetPair(0, *second.offset_from_previous, &first.t_O, &second.t_O);
    const NodeInformation remaining = eliminateFirst(
        system.diagonal[0], system.coupling[0], system.gradient[0], system.diagonal[1], system.gradient[1]);
    window_.prior->set(priorFromInformation(remaining, second.x, second.t_O));

    left_.push_back(node(0));
    pool_.recycle(std::move(window_.nodes.front()));
    window_.nodes.erase(window_.nodes.begin());
    pool_.recycle(std::move(window_.nodes.front().imu_from_previous));
    pool_.recycle(std::move(window_.nodes.front().offset_from_previous));
  }
  return left_;
}

std::string toString(FixedLagSmoother::AddResult result) {
  switch (result) {
    case FixedLagSmoother::AddResult::kAdded:
      return "";
    case FixedLagSmoother::AddResult::kOlderThanWindow:
      return "older_than_window";
    case FixedLagSmoother::AddResult::kDuplicateStamp:
      return "duplicate_stamp";
  }
  return "";
}

Time FixedLagSmoother::imuNeededSince() const {
  // Offsets move a radar factor's time by at most the bound to either side of its stamp, and the stamp lies
  // within the bound of the node.
  return window_.nodes.front().time - (2.0 * options_.max_time_offset + kOffsetHalfWidth);
}

}  // namespace rio_t
