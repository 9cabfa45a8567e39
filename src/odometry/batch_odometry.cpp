#include "rio_t/odometry/batch_odometry.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <stdexcept>
#include <utility>

#include "rio_t/factors/imu_factor.h"
#include "rio_t/odometry/imu_propagator.h"

namespace rio_t {
namespace {

constexpr int kState = StateBlock::kTangent;

StateBlock stateBlock(const NavigationState& state) {
  StateBlock x;
  x.q_WI() = state.q_WI;
  x.p_W() = state.p_W;
  x.v_W() = state.v_W;
  x.b_g() = state.b_g;
  x.b_a() = state.b_a;
  return x;
}

}  // namespace

BatchOdometry::BatchOdometry(const OdometryOptions& options, const BatchOptions& batch)
    : options_(options), batch_(batch), g_W_(0.0, 0.0, -options.gravity) {}

void BatchOdometry::addImu(const std::vector<ImuMeasurement>& taken) {
  for (const ImuMeasurement& sample : taken) imu_.add(sample);
}

void BatchOdometry::startAgain(bool has_started) {
  if (has_started)
    throw std::runtime_error(
        "batch: the IMU's clock jumped or it was silent for longer than max_bridged_imu_gap; "
        "no single graph goes over that: use mode online, or bag_start and bag_duration");
  imu_.clear();
  scans_.clear();
}

void BatchOdometry::addResult(ScanResult result) {
  if (!result.used && result.rejected_because.empty()) return;  // only carries the last poses
  result.scan.points = {};
  result.left_window.clear();
  if (result.updated) model_error_scale_ = result.model_error_scale;
  scans_.push_back(std::move(result));
}

BatchResult BatchOdometry::solve(const RadarInertialOdometry::Start& start) const {
  const BatchSmoother smoother(options_.smoother, batch_, options_.imu_noise.scaled(model_error_scale_), g_W_,
                               imu_);
  const Run run = makeRun(start);
  if (run.problem.scans.empty()) throw std::runtime_error("batch: the online run used no scan");
  BatchResult batch;
  batch.solution = smoother.solve(run.problem);
  batch.trajectory = trajectory(batch.solution);
  batch.scans = results(run, batch.solution);
  return batch;
}

void BatchOdometry::setMeasurement(const ScanResult& result, BatchScan& scan) const {
  const double rescaled = model_error_scale_ / result.model_error_scale;
  if (result.doppler) {
    scan.doppler = result.doppler;
    scan.doppler->shared_variances *= rescaled;
  } else {
    scan.velocity = {result.taken, result.ego_velocity.v_R, result.ego_velocity.covariance};
    scan.velocity->covariance.diagonal() += (rescaled - 1.0) * result.ego_velocity.added_variance;
  }
}

BatchOdometry::Run BatchOdometry::makeRun(const RadarInertialOdometry::Start& start) const {
  Run run;
  BatchProblem& problem = run.problem;
  problem.start = start.time;
  problem.prior = start.prior;
  problem.radar = start.radar;
  for (std::size_t k = 0; k < options_.radarCount(); ++k) problem.radars.push_back(options_.ofRadar(k));
  problem.vehicle = vehicle(start);
  problem.heights = heights();
  problem.barometer_drift = options_.barometer.drift;
  problem.guess.push_back({start.time, start.prior.x0});
  std::vector<std::deque<Time>> steps(problem.radars.size());  // the stamps of the first scans after them
  for (const ScanResult& result : scans_)
    if (result.offset_stepped) steps[result.scan.radar].push_back(result.offset_stepped->first);
  for (std::size_t i = 0; i < scans_.size(); ++i) {
    const ScanResult& result = scans_[i];
    const std::size_t radar = result.scan.radar;
    if (!result.updated) continue;
    const NodeEstimate node{result.state.time, stateBlock(result.state)};
    if (node.time > problem.guess.back().time) problem.guess.push_back(node);
    BatchScan scan;
    scan.stamp = result.scan.stamp;
    scan.t_O = result.time_offset;
    scan.radar = radar;
    for (; !steps[radar].empty() && steps[radar].front() <= scan.stamp; steps[radar].pop_front())
      scan.offset_stepped = true;
    if (result.at_rest) scan.rest_velocity_sigma = result.rest_velocity_sigma;
    if (result.used) setMeasurement(result, scan);
    scan.moves_as_vehicle = result.ground_vehicle && result.ground_vehicle->used;
    problem.scans.push_back(scan);
    run.source.push_back(i);
  }
  return run;
}

std::optional<BatchVehicle> BatchOdometry::vehicle(const RadarInertialOdometry::Start& start) const {
  // If the motion contradicted the vehicle at any time, the batch does not use the constraint.
  const auto contradicts = [](const ScanResult& result) {
    return result.ground_vehicle && result.ground_vehicle->is_contradicted;
  };
  if (options_.platform != Platform::kGroundVehicle || std::any_of(scans_.begin(), scans_.end(), contradicts))
    return std::nullopt;
  const GroundVehicleOptions& o = options_.ground_vehicle;
  const double slope_sigma = start.from == InitializedFrom::kRest ? o.start_slope_sigma : 0.0;
  return BatchVehicle{o.T_IV, o.rotation_sigma, slope_sigma, {o.sideways_sigma, o.vertical_sigma}};
}

std::vector<BatchHeight> BatchOdometry::heights() const {
  std::vector<BatchHeight> heights;
  for (const ScanResult& result : scans_) {
    for (const BarometerAnswer& mean : result.barometer) {
      if (mean.rejected_because.empty())
        heights.push_back({mean.time, mean.height + mean.bias, mean.noise_sigma, mean.stepped});
      // BarometerChannel has removed these means from its window, too, since the pressure may have moved.
      while (mean.rejected_because == "pressure_moves" && !heights.empty() &&
             mean.time - heights.back().time < options_.smoother.window)
        heights.pop_back();
    }
  }
  return heights;
}

std::vector<NavigationState> BatchOdometry::trajectory(const BatchSolution& solution) const {
  const std::vector<NodeEstimate>& nodes = solution.nodes;
  std::vector<NavigationState> states;
  for (std::size_t k = 0; k + 1 < nodes.size(); ++k) {
    const NodeEstimate& node = nodes[k];
    const NodeEstimate& next = nodes[k + 1];
    // The IMU alone misses the next node. This error is spread linearly over the time between the nodes. The
    // biases are those of the IMU factor.
    StateBlock x = node.x;
    x.b_g() = next.x.b_g();
    x.b_a() = next.x.b_a();
    const StateBlock missed_by = carried(x, node.time, next.time, imu_, g_W_);
    const StateTangent miss = boxminus(next.x.data(), missed_by.data());
    if (k == 0) states.push_back(navigationState(node, solution.covariances[0], imu_));
    NodeEstimate at = node;
    Time carried_to = node.time;
    imu_.forEachSample(node.time, next.time, [&](const ImuMeasurement& sample) {
      x = carried(x, carried_to, sample.time, imu_, g_W_);
      carried_to = sample.time;
      const double share = (sample.time - node.time) / (next.time - node.time);
      const StateTangent part = share * miss;
      at.time = sample.time;
      boxplus(x.data(), part.data(), at.x.data());
      const StateCovariance covariance =
          (1.0 - share) * solution.covariances[k] + share * solution.covariances[k + 1];
      if (!sample.is_bridge) states.push_back(navigationState(at, covariance, imu_));
    });
  }
  // After the last scan, the IMU alone carries the state.
  ImuPropagator propagator(options_.imu_noise.scaled(model_error_scale_), g_W_);
  propagator.anchor(navigationState(nodes.back(), solution.covariances.back(), imu_));
  imu_.forEachSample(nodes.back().time - 0.1, imu_.newest(), [&](const ImuMeasurement& sample) {
    propagator.add(sample);
    const std::optional<NavigationState> state = propagator.state();
    if (state && state->time > nodes.back().time && !sample.is_bridge) states.push_back(*state);
  });
  return states;
}

std::vector<ScanResult> BatchOdometry::results(const Run& run, const BatchSolution& solution) const {
  std::vector<ScanResult> results;
  for (const ScanResult& scan : scans_) {
    results.push_back(scan);
    results.back().updated = false;
  }
  std::vector<std::size_t> node_of(results.size());
  for (std::size_t j = 0; j < run.source.size(); ++j) {
    const BatchSolution::Scan& solved = solution.scans[j];
    const std::size_t k = solved.node;
    ScanResult& result = results[run.source[j]];
    node_of[run.source[j]] = k;
    result.updated = true;
    result.used = run.problem.scans[j].velocity || run.problem.scans[j].doppler;
    if (result.used) result.rejected_because.clear();
    result.state = navigationState(solution.nodes[k], solution.covariances[k], imu_);
    result.time_offset = solved.t_O;
    result.T_IR = solution.extrinsics[result.scan.radar];
    result.T_IR_covariance = extrinsicsCovariance(solution.extrinsics_covariances[result.scan.radar],
                                                  options_.smoother.estimate_extrinsics);
    result.solver_termination = solution.termination;
    result.time_offset_sigma = std::sqrt(solved.covariance(kState, kState));
  }
  std::vector<std::size_t> order(results.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return results[a].scan.stamp < results[b].scan.stamp;
  });
  std::vector<ScanResult> sorted;
  std::size_t next = 0;  // node whose pose comes next
  for (const std::size_t i : order) {
    const bool last = i == order.back();
    const std::size_t until = last ? solution.nodes.size() : results[i].updated ? node_of[i] + 1 : next;
    for (; next < until; ++next) {
      const NodeEstimate& node = solution.nodes[next];
      results[i].left_window.push_back({node.time, node.x.p_W(), node.x.q_WI()});
    }
    sorted.push_back(std::move(results[i]));
  }
  return sorted;
}

}  // namespace rio_t
