#include "rio_t/smoother/batch_smoother.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <unordered_map>
#include <utility>

#include "rio_t/factors/barometer_factor.h"
#include "rio_t/factors/ground_vehicle_factor.h"
#include "rio_t/factors/imu_factor.h"
#include "rio_t/factors/random_walk_factor.h"
#include "rio_t/factors/zero_velocity_factor.h"
#include "rio_t/graph/marginalization.h"
#include "rio_t/imu/preintegration.h"

namespace rio_t {
namespace {

/// [sigma^2] The solver stops if the squared length of the next step is below this.
constexpr double kConverged = 1e-4;
/// [sigma^2] If the part of this step in each block is below this, the solution is accepted even if the
/// solver did not stop by itself.
constexpr double kNear = 1e-2;

using BlockCovariances = std::vector<std::map<int, Eigen::MatrixXd>>;

/// Whether the next step moves every block by less than a tenth of its standard deviation.
bool isNextStepSmall(const Solution& solved, const BlockCovariances& P) {
  const std::vector<Eigen::VectorXd>& delta = solved.elimination.delta();
  for (std::size_t i = 0; i < delta.size(); ++i) {
    if (delta[i].isZero(0.0)) continue;  // as that of a held block
    const Eigen::MatrixXd& P_ii = P[i].at(static_cast<int>(i));
    if (delta[i].dot(P_ii.ldlt().solve(delta[i])) > kNear) return false;
  }
  return true;
}

/// Whether every offset is within a tenth of its standard deviation of the one that placed its node.
bool areOffsetsNear(const BatchSolution& solution, const std::vector<double>& placed_by) {
  for (std::size_t i = 0; i < placed_by.size(); ++i) {
    const BatchSolution::Scan& scan = solution.scans[i];
    const double variance = scan.covariance(StateBlock::kTangent, StateBlock::kTangent);
    const double apart = scan.t_O - placed_by[i];
    if (apart * apart > kNear * variance) return false;
  }
  return true;
}

/// [rad] A turn of the mounting over which its factors are linear enough: half its square is 5e-5 of the
/// velocity.
constexpr double kLinear = 0.01;

/// If the offsets may take only this share of their move, they oscillate from placement to placement.
constexpr double kLeastShare = 0.01;

/// Joint covariance of some blocks that the elimination connects.
Eigen::MatrixXd jointCovariance(const BlockCovariances& P, const std::vector<int>& blocks) {
  Eigen::Index size = 0;
  for (const int i : blocks) size += P[i].at(i).rows();
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(size, size);
  Eigen::Index row = 0;
  for (const int i : blocks) {
    const Eigen::Index rows = P[i].at(i).rows();
    Eigen::Index column = 0;
    for (const int j : blocks) {
      const Eigen::Index columns = P[j].at(j).rows();
      const auto found = P[i].find(j);  // none if j < i, or if one of them is held
      if (found != P[i].end()) {
        result.block(row, column, rows, columns) = found->second;
        result.block(column, row, columns, rows) = found->second.transpose();
      }
      column += columns;
    }
    row += rows;
  }
  return result;
}

}  // namespace

BatchSmoother::BatchSmoother(const SmootherOptions& options, const BatchOptions& batch, const ImuNoise& noise,
                             const Eigen::Vector3d& g_W, const ImuBuffer& imu)
    : options_(options),
      batch_(batch),
      noise_(noise),
      g_W_(g_W),
      imu_(&imu),
      motion_manifold_(std::make_shared<MotionManifold>()),
      bias_manifold_(std::make_shared<VectorManifold>(StateBlock::kBiases)),
      offset_manifold_(std::make_shared<VectorManifold>(1)),
      extrinsics_manifold_(std::make_shared<ExtrinsicsManifold>(options.estimate_extrinsics)),
      loss_(huberLoss(options.huber_threshold)) {}

void BatchSmoother::start(const BatchProblem& problem, const StateBlock& x,
                          const std::vector<Extrinsics>& mounting, Graph& graph) const {
  Window& window = graph.window;
  Block& motion = window.addNode(problem.start, motion_manifold_, storedMotion(problem.prior.x0));
  Block& biases = addBiases(window, problem.start, problem.prior.x0);
  graph.nodes.push_back({&motion, &biases});
  const bool is_estimated = options_.estimate_extrinsics != EstimateExtrinsics::kNone;
  std::vector<Block*> offsets;
  for (std::size_t k = 0; k < mounting.size(); ++k) {
    const bool is_first = k == 0 || !options_.time_offset_shared;
    const bool has_prior = k == problem.radar || options_.time_offset_shared;
    const double t_O = has_prior ? problem.prior.t_O0 : problem.radars[k].time_offset_initial;
    offsets.push_back(is_first ? &addOffset(window, problem.start, t_O) : offsets.front());
  }
  std::vector<Block*> known = {&motion, &biases, offsets.at(problem.radar)};
  for (std::size_t k = 0; k < mounting.size(); ++k) {
    const bool has_prior = k == problem.radar;
    // The prior has its own mounting as its origin, so the block starts there.
    const Extrinsics& configured = has_prior ? problem.prior.T_IR0 : problem.radars[k].T_IR;
    Block& extrinsics = *window.addCalibration(extrinsics_manifold_, stored(configured));
    graph.extrinsics.push_back(&extrinsics);
    if (!is_estimated) window.setConstant(extrinsics, true);
    if (has_prior) {
      if (is_estimated) known.push_back(&extrinsics);
      continue;
    }
    if (!options_.time_offset_shared)
      addPrior(window, *offsets[k], Eigen::VectorXd::Constant(1, problem.radars[k].time_offset_sigma));
    if (is_estimated) addPrior(window, extrinsics, extrinsicsSigmas(options_, problem.radars[k]));
  }
  addPrior(window, known, problem.prior.root);
  motion.x = storedMotion(x);
  biases.x = storedBiases(x);
  for (std::size_t k = 0; k < mounting.size(); ++k)
    if (is_estimated) graph.extrinsics[k]->x = stored(mounting[k]);
  for (Block* offset : offsets) graph.clocks.push_back({offset});
  if (problem.vehicle) addVehicle(*problem.vehicle, graph);
}

void BatchSmoother::addVehicle(const BatchVehicle& vehicle, Graph& graph) const {
  const auto manifold = std::make_shared<ExtrinsicsManifold>(EstimateExtrinsics::kRotation);
  graph.vehicle = graph.window.addCalibration(manifold, stored(vehicle.T_IV)).get();
  addPrior(graph.window, *graph.vehicle, Eigen::Vector3d::Constant(vehicle.rotation_sigma));
  if (vehicle.start_slope_sigma > 0.0)
    graph.window.add(std::make_unique<LevelGroundFactor>(vehicle.start_slope_sigma),
                     {graph.nodes.front().motion, graph.vehicle});
}

void BatchSmoother::constrain(const BatchVehicle& vehicle, Graph& graph) const {
  Graph::Node& node = graph.nodes.back();
  if (std::exchange(node.moves_as_vehicle, true)) return;  // by the scan of another radar
  const Eigen::Vector3d omega_I = imu_->mean(*node.motion->time, kVehicleGyroHalfWidth).angular_velocity;
  graph.window.add(std::make_unique<GroundVehicleFactor>(omega_I, vehicle.sigmas),
                   {node.motion, node.biases, graph.vehicle}, loss_);
}

void BatchSmoother::addHeights(const BatchProblem& problem, Graph& graph) {
  const auto manifold = std::make_shared<VectorManifold>(1);
  const std::vector<NodeEstimate> states = graph.states();
  Block*& bias = graph.barometer_bias;
  for (const BatchHeight& mean : problem.heights) {
    const std::size_t k = nearestNode(states, mean.time);
    const Time time = states[k].time;
    const bool is_unknown = bias == nullptr || mean.stepped;
    if (is_unknown || *bias->time < time) {
      const Eigen::VectorXd guess = Eigen::VectorXd::Constant(1, mean.height - states[k].x.p_W().z());
      Block& next = graph.window.addNode(time, manifold, guess);
      if (is_unknown) {
        addPrior(graph.window, next, Eigen::VectorXd::Constant(1, kUnknownBarometerBias));
      } else {
        const double sigma = problem.barometer_drift * std::sqrt(time - *bias->time);
        graph.window.add(std::make_unique<RandomWalkFactor>(Eigen::VectorXd::Constant(1, sigma)),
                         {bias, &next});
      }
      bias = &next;
    }
    graph.window.add(std::make_unique<BarometerFactor>(mean.height, mean.time - time, mean.sigma),
                     {graph.nodes[k].motion, bias});
  }
}

std::vector<NodeEstimate> BatchSmoother::Graph::states() const {
  std::vector<NodeEstimate> states;
  states.reserve(nodes.size());
  for (const Node& node : nodes) states.push_back({*node.motion->time, stateOf(*node.motion, *node.biases)});
  return states;
}

BatchSmoother::Graph BatchSmoother::place(const BatchProblem& problem, const std::vector<double>& t_O,
                                          const BatchSolution& guess) const {
  const std::size_t scans = problem.scans.size();
  std::vector<Time> times(scans);
  for (std::size_t i = 0; i < scans; ++i) {
    const Time time = atMeasurement() ? problem.scans[i].stamp - t_O[i] : problem.scans[i].stamp;
    times[i] = std::clamp(time, problem.start, std::max(problem.start, imu_->newest()));
  }
  std::vector<std::size_t> order(scans);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return times[a] < times[b]; });
  const auto stateAt = [&](Time time) {
    const NodeEstimate& near = guess.nodes[nearestNode(guess.nodes, time)];
    return carried(near.x, near.time, time, *imu_, g_W_);
  };

  const double spacing = minNodeSpacing(options_.time_offset_model);
  const bool is_estimated = options_.estimate_extrinsics != EstimateExtrinsics::kNone;
  Graph graph;
  graph.scans.resize(scans);
  start(problem, stateAt(problem.start), guess.extrinsics, graph);
  for (const std::size_t i : order) {
    const BatchScan& scan = problem.scans[i];
    if (times[i] - *graph.nodes.back().motion->time > spacing) addNode(times[i], stateAt(times[i]), graph);
    Block* offset = offsetOf(problem, scan, t_O[i], graph);
    graph.scans[i] = {graph.nodes.size() - 1, offset, graph.extrinsics[scan.radar],
                      is_estimated ? std::make_shared<SlowMotion>() : nullptr};
    addTerms(scan, graph.scans[i], t_O[i], graph);
    if (problem.vehicle && scan.moves_as_vehicle) constrain(*problem.vehicle, graph);
  }
  addHeights(problem, graph);
  if (!is_estimated) return graph;
  const std::vector<NodeEstimate> nodes = graph.states();
  std::vector<std::vector<SlowMotion*>> motions(graph.extrinsics.size());
  for (std::size_t i = 0; i < scans; ++i) {
    const RadarScanTime* taken = problem.scans[i].measurement();
    if (taken == nullptr) continue;
    const Extrinsics& T_IR = guess.extrinsics[problem.scans[i].radar];
    *graph.scans[i].slow = slowMotion(nodes, graph.scans[i].node, taken->slow_half_width, *imu_, T_IR, T_IR);
    motions[problem.scans[i].radar].push_back(graph.scans[i].slow.get());
  }
  for (const std::vector<SlowMotion*>& of_radar : motions) keepTurns(of_radar);
  return graph;
}

void BatchSmoother::addNode(Time time, const StateBlock& x, Graph& graph) const {
  Window& window = graph.window;
  const Graph::Node previous = graph.nodes.back();
  const Time since = *previous.motion->time;
  Graph::Node next{&window.addNode(time, motion_manifold_, storedMotion(x)), previous.biases};
  if (since >= *next.biases->time) {
    next.biases = &addBiases(window, since, x);
    const double dt = *next.biases->time - *previous.biases->time;
    window.add(std::make_unique<RandomWalkFactor>(biasWalkVariance(noise_, dt).cwiseSqrt()),
               {previous.biases, next.biases});
  }
  const StateView at(next.motion->x.data(), next.biases->x.data());
  window.add(std::make_unique<ImuFactor>(preintegrate(*imu_, since, time, at.b_g, at.b_a, noise_), g_W_),
             {previous.motion, next.motion, next.biases});
  graph.nodes.push_back(next);
}

Block* BatchSmoother::offsetOf(const BatchProblem& problem, const BatchScan& scan, double t_O,
                               Graph& graph) const {
  auto& [offset, stepped] = graph.clocks[options_.time_offset_shared ? 0 : scan.radar];
  stepped = stepped || scan.offset_stepped;
  if (options_.estimate_time_offset && *offset->time == problem.start) offset->x[0] = t_O;
  const Time time = *graph.nodes.back().motion->time;
  const double dt = time - *offset->time;
  if (dt <= 0.0) return offset;
  Block& previous = *offset;
  offset = &addOffset(graph.window, time, t_O);
  const double sigma =
      stepped ? problem.radars[scan.radar].time_offset_sigma : options_.time_offset_noise * std::sqrt(dt);
  graph.window.add(std::make_unique<RandomWalkFactor>(Eigen::VectorXd::Constant(1, sigma)),
                   {&previous, offset});
  stepped = false;
  return offset;
}

void BatchSmoother::addTerms(const BatchScan& scan, const Graph::Scan& at, double t_O, Graph& graph) const {
  Graph::Node& node = graph.nodes[at.node];
  const Time time = *node.motion->time;
  const std::vector<Block*> blocks = {node.motion, node.biases, at.offset, at.extrinsics};
  // First order in t_O is enough, since nodes are placed again if the offset moves. A gain below 1 needs
  // first order, since it multiplies the derivative.
  const auto placed = [&](auto z) {
    const bool is_linear = atMeasurement() || z.offset_gain < 1.0;
    z.linear_from_t_O = is_linear ? std::make_shared<const double>(t_O) : nullptr;
    z.slow = at.slow;
    return z;
  };
  if (scan.doppler) {
    graph.window.add(std::make_unique<DopplerFactor>(placed(*scan.doppler), time, model()), blocks);
  } else if (scan.velocity) {
    graph.window.add(std::make_unique<RadarVelocityFactor>(placed(*scan.velocity), time, model()), blocks,
                     loss_);
  }
  // Scans of two radars at the same time share a node, and rest counts once.
  if (scan.rest_velocity_sigma && !std::exchange(node.rests, true))
    graph.window.add(std::make_unique<ZeroVelocityFactor>(*scan.rest_velocity_sigma), {node.motion});
}

Block& BatchSmoother::addOffset(Window& window, Time time, double t_O) const {
  Block& offset = window.addNode(time, offset_manifold_, Eigen::VectorXd::Constant(1, t_O));
  offset.bound = options_.max_time_offset;
  if (!options_.estimate_time_offset) window.setConstant(offset, true);
  return offset;
}

Block& BatchSmoother::addBiases(Window& window, Time since, const StateBlock& x) const {
  // With this time, they are eliminated after all but the last of their nodes. This keeps the fill-in small.
  return window.addNode(since + options_.window, bias_manifold_, storedBiases(x));
}

RadarMotionModel BatchSmoother::model() const {
  return {options_.time_offset_model, options_.max_time_offset, g_W_, imu_};
}

BatchSolution BatchSmoother::solve(const BatchProblem& problem) const {
  if (problem.guess.empty()) throw std::invalid_argument("batch: no state to begin from");
  std::vector<double> t_O;
  for (const BatchScan& scan : problem.scans) t_O.push_back(scan.t_O);
  BatchSolution solution;
  solution.nodes = problem.guess;
  for (const CalibrationPrior& radar : problem.radars) solution.extrinsics.push_back(radar.T_IR);

  double moved_before = std::numeric_limits<double>::infinity();
  double share = 1.0;  // of its move that an offset takes
  for (;;) {
    Graph graph = place(problem, t_O, solution);
    ++solution.placements;
    const std::vector<Extrinsics> linear_from = std::exchange(solution.extrinsics, {});
    Solution solved = rio_t::solve(graph.window, {batch_.max_iterations - solution.iterations, kConverged},
                                   options_.solver);
    solution.iterations += solved.iterations;
    read(graph, solution);
    double moved = 0.0;  // [s]
    for (std::size_t i = 0; i < t_O.size(); ++i)
      moved = std::max(moved, std::abs(solution.scans[i].t_O - t_O[i]));
    const bool offsets_hold = !atMeasurement() || moved <= batch_.placement_tolerance;
    const bool placed = offsets_hold && mountingsHold(graph, solved, linear_from);
    const bool oscillates = share < kLeastShare;
    if (placed || oscillates || solution.iterations >= batch_.max_iterations) {
      const BlockCovariances P = solved.elimination.covariances();
      readCovariances(graph, solved, P, solution);
      solution.termination = solved.termination;
      if (!solved.converged() && isNextStepSmall(solved, P))
        solution.termination = SolverTermination::kConverged;
      if (solution.converged() && !placed && !areOffsetsNear(solution, t_O))
        solution.termination =
            oscillates ? SolverTermination::kNoDecrease : SolverTermination::kIterationLimit;
      solution.system = std::move(solved.system);
      solution.system.blocks.clear();  // they go with the graph
      return solution;
    }
    if (offsets_hold) continue;
    // The offset of a sparse radar may oscillate: nodes that are placed late make it early, and the reverse.
    if (moved > 0.5 * moved_before) share *= 0.5;
    moved_before = moved;
    for (std::size_t i = 0; i < t_O.size(); ++i) t_O[i] += share * (solution.scans[i].t_O - t_O[i]);
  }
}

bool BatchSmoother::mountingsHold(const Graph& graph, const Solution& solved,
                                  const std::vector<Extrinsics>& linear_from) {
  for (std::size_t k = 0; k < linear_from.size(); ++k) {
    const Block& block = *graph.extrinsics[k];
    if (block.is_constant) continue;
    const Eigen::Vector3d turn = turnBetween(linear_from[k], toExtrinsics(block.x.data()));
    if (turn.norm() <= kLinear) continue;
    const Eigen::MatrixXd P = solved.elimination.covariance({solved.system.indexOf(block)});
    if (turn.dot(P.topLeftCorner<3, 3>().ldlt().solve(turn)) > 1.0) return false;
  }
  return true;
}

void BatchSmoother::read(const Graph& graph, BatchSolution& solution) {
  solution.nodes = graph.states();
  solution.scans.clear();
  for (const Graph::Scan& scan : graph.scans) solution.scans.push_back({scan.node, scan.offset->x[0], {}});
  solution.extrinsics.clear();
  for (const Block* block : graph.extrinsics) solution.extrinsics.push_back(toExtrinsics(block->x.data()));
  if (graph.vehicle != nullptr) solution.T_IV = toExtrinsics(graph.vehicle->x.data());
  if (graph.barometer_bias != nullptr) solution.barometer_bias = graph.barometer_bias->x[0];
}

void BatchSmoother::readCovariances(const Graph& graph, const Solution& solved, const BlockCovariances& P,
                                    BatchSolution& solution) {
  std::unordered_map<const Block*, int> index;
  for (const Block* block : solved.system.blocks) index.emplace(block, static_cast<int>(index.size()));
  for (const Graph::Node& node : graph.nodes)
    solution.covariances.emplace_back(jointCovariance(P, {index.at(node.motion), index.at(node.biases)}));
  for (std::size_t i = 0; i < graph.scans.size(); ++i) {
    const Graph::Scan& scan = graph.scans[i];
    const Graph::Node& node = graph.nodes[scan.node];
    std::vector<int> blocks = {index.at(node.motion), index.at(node.biases), index.at(scan.offset)};
    if (!scan.extrinsics->is_constant) blocks.push_back(index.at(scan.extrinsics));
    solution.scans[i].covariance = jointCovariance(P, blocks);
  }
  const auto covarianceOf = [&](const Block* block) {
    const int i = index.at(block);
    return P[i].at(i);
  };
  for (const Block* block : graph.extrinsics)
    solution.extrinsics_covariances.push_back(block->is_constant ? Eigen::MatrixXd() : covarianceOf(block));
  if (graph.vehicle != nullptr) solution.q_IV_sigma = covarianceOf(graph.vehicle).diagonal().cwiseSqrt();
  if (graph.barometer_bias != nullptr)
    solution.barometer_bias_sigma = std::sqrt(covarianceOf(graph.barometer_bias)(0, 0));
}

}  // namespace rio_t
