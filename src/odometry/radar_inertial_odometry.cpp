#include "rio_t/odometry/radar_inertial_odometry.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <mutex>
#include <utility>

#include "rio_t/factors/offset_derivative.h"
#include "rio_t/odometry/fault_counters.h"
#include "rio_t/odometry/initializer.h"
#include "rio_t/odometry/innovation_gate.h"
#include "rio_t/odometry/model_error_scale.h"
#include "rio_t/odometry/imu_propagator.h"
#include "rio_t/odometry/offset_uncertainty.h"
#include "rio_t/odometry/pose_doubt.h"
#include "rio_t/odometry/yaw_doubt.h"
#include "rio_t/smoother/fixed_lag_smoother.h"

namespace rio_t {
namespace {

/// The IMU must be this far past a scan's node [s]: the derivative with respect to t_O looks so far ahead,
/// and the factor's time may still move a little.
constexpr double kImuMargin = kOffsetHalfWidth + 0.01;
/// A scan stamped further ahead of the newest IMU sample is nonsense, not early [s]; unless the IMU may still
/// come.
constexpr double kMaxStampAhead = 1.0;
/// Where roll and pitch are known no better [rad], the prediction is not linear in them, and its covariance
/// too small to reject anything by.
constexpr double kMaxTiltSigma = 0.1;
/// Without a scan the window moves on in such steps [s], or the IMU that it needs would grow without end; and
/// stays so far behind, for scans that are late.
constexpr double kSilentStep = 5.0;
constexpr double kLateScan = 1.0;

/// How many of `some` are not in `others`; both ascend.
std::size_t countOthers(const std::vector<std::size_t>& some, const std::vector<std::size_t>& others) {
  return static_cast<std::size_t>(std::count_if(some.begin(), some.end(), [&](std::size_t index) {
    return !std::binary_search(others.begin(), others.end(), index);
  }));
}

/// As made anew, but with the memory of its lists.
void clear(ScanResult& result) {
  std::vector<std::size_t> inliers = std::move(result.ego_velocity.inliers);
  std::vector<StampedPose> left_window = std::move(result.left_window);
  inliers.clear();
  left_window.clear();
  result = ScanResult();
  result.ego_velocity.inliers = std::move(inliers);
  result.left_window = std::move(left_window);
}

}  // namespace

struct RadarInertialOdometry::Impl {
  explicit Impl(const OdometryOptions& options_in)
      : options(options_in),
        g_W(0.0, 0.0, -options.gravity),
        R_RI(options.T_IR.q_IR.conjugate().toRotationMatrix()),
        max_stamp_ahead(std::max(kMaxStampAhead, options.imu_input_check.max_bridged_gap)),
        imu_input_check(options.max_imu_gap, options.imu_input_check),
        propagator(options.imu_noise, g_W),
        initializer(options),
        recovery(options),
        ego_velocity_estimator(options.ego_velocity),
        feasibility(options.feasibility),
        offset_step_detector(options.offset_step_detector),
        offset_uncertainty(options.smoother.huber_threshold),
        innovation_gate(options.smoother),
        health_monitor(options.health, options.smoother.innovation_gate),
        smoother(emptySmoother()) {
    waiting_for = initializer.waitingFor();
  }

  FixedLagSmoother emptySmoother() const { return {options.smoother, options.imu_noise, g_W, imu}; }
  void drainInbox();
  void startAgain();
  void watchRadar(bool scan_came);
  void carryWindow();
  void anchorPropagator(const NavigationState& state, bool at_rest = false);
  void tryInitialize(const ImuMeasurement& sample);
  void begin(Time time, const NodePrior& prior);
  /// The poses of the window that is given up go to `left`.
  bool tryReinitialize(std::vector<StampedPose>& left);
  PoseAnchor anchorAt(Time time) const;
  void updateHealth();
  void publishNewest();
  void judgePrediction(const RadarScan& scan, const VelocityPrior& prior, const EgoVelocity& measured);
  bool isAtRest(Time time) const;
  /// With the noise that the scans before show.
  void measureAt(const RadarScan& scan, const std::optional<VelocityPrior>& prior, EgoVelocity& measured);
  /// Empty, or why the scan has no velocity to use; and the offset that it holds on to, where it tells none.
  std::string measureVelocity(const RadarScan& scan, bool at_rest, EgoVelocity& measured,
                              std::optional<double>& held_t_O);
  /// The IMU that covers the scan may still come.
  bool mustWait(const RadarScan& scan) const;
  /// Sets `result` to what became of the scan, and moves the scan there.
  void finishScan(RadarScan& scan, bool imu_has_ended);
  void useScan(const RadarScan& scan, bool imu_has_ended);
  void updateWindow();
  ImuNoise imuNoise() const;  ///< likewise
  NavigationState newestState(const NodeMatrix& covariance) const;

  const OdometryOptions options;
  const Eigen::Vector3d g_W;
  const Eigen::Matrix3d R_RI;
  const double max_stamp_ahead;  ///< [s]
  FaultCounters faults;

  // The navigation half; guarded by navigation_mutex, held for microseconds.
  std::mutex navigation_mutex;
  ImuInputCheck imu_input_check;
  ImuPropagator propagator;
  std::uint64_t clock_restarts = 0;  ///< how often the time of the IMU started again

  // From the feeding threads to the optimisation half; guarded by inbox_mutex.
  mutable std::mutex inbox_mutex;
  std::vector<ImuMeasurement> imu_inbox;
  std::vector<RadarScan> scan_inbox;
  std::uint64_t inbox_clock_restarts = 0;  ///< imu_inbox is from after that many
  bool is_initialized = false;
  std::string waiting_for;
  Health health = Health::kOk;

  // The optimisation half; only the thread in process() touches these.
  ImuBuffer imu;
  Initializer initializer;
  MotionInitializer recovery;  ///< from divergence
  EgoVelocityEstimator ego_velocity_estimator;
  FeasibilityCheck feasibility;
  OffsetStepDetector offset_step_detector;
  OffsetUncertainty offset_uncertainty;
  ModelErrorScale model_error_scale;
  InnovationGate innovation_gate;
  HealthMonitor health_monitor;
  FixedLagSmoother smoother;
  std::vector<RadarScan> waiting_scans;  ///< oldest first
  ScanResult result;                     ///< of the scan at hand, as the next two; they keep their memory
  EgoVelocity velocity_alone;
  EgoVelocityWorkspace ego_velocity_workspace;
  std::optional<Start> start;
  Time initialized_at;
  PoseDoubt pose_doubt;
  YawDoubt yaw_doubt;
  std::vector<ImuMeasurement> imu_drained;
  /// Poses that no scan pushed out of the window; for the next result.
  std::vector<StampedPose> left_in_silence;
  std::uint64_t clock_restarts_done = 0;
  std::optional<Time> radar_heard;  ///< IMU time when a scan came last
  bool radar_is_silent = false;
};

RadarInertialOdometry::RadarInertialOdometry(const OdometryOptions& options)
    : impl_(std::make_unique<Impl>(options)) {}
RadarInertialOdometry::~RadarInertialOdometry() = default;
RadarInertialOdometry::RadarInertialOdometry(RadarInertialOdometry&&) noexcept = default;
RadarInertialOdometry& RadarInertialOdometry::operator=(RadarInertialOdometry&&) noexcept = default;

std::optional<NavigationState> RadarInertialOdometry::addImu(const ImuMeasurement& imu) {
  Impl& m = *impl_;
  ImuMeasurement sample = imu;
  std::optional<NavigationState> state;
  std::vector<ImuMeasurement> bridge;
  std::uint64_t clock_restarts = 0;
  {
    const std::lock_guard<std::mutex> lock(m.navigation_mutex);
    ImuInputCheck::Verdict verdict = m.imu_input_check.check(sample);
    for (const char* fault : verdict.faults) m.faults.count(fault);
    if (verdict.decision == ImuInputCheck::Decision::kDrop) return std::nullopt;
    if (verdict.decision == ImuInputCheck::Decision::kRestart) {
      m.propagator = ImuPropagator(m.options.imu_noise, m.g_W);
      ++m.clock_restarts;
    }
    clock_restarts = m.clock_restarts;
    bridge = std::move(verdict.bridge);
    for (const ImuMeasurement& unseen : bridge) m.propagator.add(unseen);
    state = m.propagator.add(sample);
  }
  const std::lock_guard<std::mutex> lock(m.inbox_mutex);
  if (m.inbox_clock_restarts != clock_restarts) {
    m.inbox_clock_restarts = clock_restarts;
    m.imu_inbox.clear();
    m.is_initialized = false;
  }
  m.imu_inbox.insert(m.imu_inbox.end(), bridge.begin(), bridge.end());
  m.imu_inbox.push_back(sample);
  return state;
}

void RadarInertialOdometry::addScan(RadarScan scan) {
  const std::lock_guard<std::mutex> lock(impl_->inbox_mutex);
  impl_->scan_inbox.push_back(std::move(scan));
}

std::vector<ScanResult> RadarInertialOdometry::process() {
  std::vector<ScanResult> results;
  process([&](ScanResult& result) { results.push_back(std::move(result)); });
  return results;
}

void RadarInertialOdometry::process(const ResultHandler& handle) {
  Impl& m = *impl_;
  m.drainInbox();
  for (auto scan = m.waiting_scans.begin(); scan != m.waiting_scans.end();) {
    if (m.mustWait(*scan)) {
      ++scan;
      continue;
    }
    m.finishScan(*scan, false);
    scan = m.waiting_scans.erase(scan);
    handle(m.result);
  }
  while (m.waiting_scans.size() > m.options.max_queued_scans) {
    clear(m.result);
    m.result.scan = std::move(m.waiting_scans.front());
    m.result.rejected_because = "queue_full";
    m.waiting_scans.erase(m.waiting_scans.begin());
    handle(m.result);
  }
  m.updateHealth();
}

bool RadarInertialOdometry::Impl::mustWait(const RadarScan& scan) const {
  if (smoother.size() == 0) return false;
  const Time node_time = smoother.nodeTime(scan.stamp);
  return node_time >= initialized_at && node_time > imu.newest() - kImuMargin &&
         node_time - imu.newest() <= max_stamp_ahead;
}

void RadarInertialOdometry::Impl::finishScan(RadarScan& scan, bool imu_has_ended) {
  clear(result);
  result.left_window.swap(left_in_silence);
  useScan(scan, imu_has_ended);
  result.health = health_monitor.health();
  result.scan = std::move(scan);
}

/// The way of a scan: when, how fast, into the window, out.
void RadarInertialOdometry::Impl::useScan(const RadarScan& scan, bool imu_has_ended) {
  const auto reject = [&](const char* reason) { result.rejected_because = reason; };
  if (smoother.size() == 0) {
    ego_velocity_estimator.estimate(scan, std::nullopt, &ego_velocity_workspace, &result.ego_velocity);
    initializer.addVelocity(scan.stamp, result.ego_velocity);
    return reject("before_initialization");
  }

  // First of all: a new start may move the offset, and with it the time of measurement.
  if (health_monitor.wantsReinitialization(imu.newest()))
    result.reinitialized = tryReinitialize(result.left_window);
  const Time node_time = smoother.nodeTime(scan.stamp);
  if (node_time < initialized_at) return reject("before_initialization");
  if (node_time - imu.newest() > max_stamp_ahead) return reject("stamp_ahead_of_imu");
  if (!imu.covers(imu_has_ended ? node_time : node_time + kImuMargin))
    return reject(imu_has_ended ? "imu_not_covering" : "older_than_window");

  result.model_error_scale = model_error_scale.value();
  smoother.setImuNoise(imuNoise());
  smoother.setTimeOffsetNoise(std::hypot(options.smoother.time_offset_noise, offset_uncertainty.walk()));
  const bool at_rest = isAtRest(node_time);
  std::optional<double> held_t_O;
  result.rejected_because = measureVelocity(scan, at_rest, result.ego_velocity, held_t_O);
  if (result.rejected_because.empty()) {
    result.rejected_because =
        toString(smoother.add({scan.stamp, result.ego_velocity.v_R, result.ego_velocity.covariance, R_RI,
                               options.T_IR.l_I, held_t_O}));
  }
  result.used = result.rejected_because.empty();
  if (result.used) innovation_gate.used(scan.stamp);
  if (result.used && !at_rest)
    ego_velocity_estimator.learn(scan, result.ego_velocity, &ego_velocity_workspace);
  result.updated = result.used;
  if (at_rest) {
    result.updated |=
        smoother.addRest(scan.stamp, options.rest.velocity_sigma) == FixedLagSmoother::AddResult::kAdded;
  }
  if (result.updated) updateWindow();
  updateHealth();
  if (!result.updated && health_monitor.health() == Health::kDiverged) publishNewest();
}

void RadarInertialOdometry::Impl::measureAt(const RadarScan& scan, const std::optional<VelocityPrior>& prior,
                                            EgoVelocity& measured) {
  ego_velocity_estimator.estimate(scan, prior, &ego_velocity_workspace, &measured);
  measured.covariance.diagonal() += (model_error_scale.value() - 1.0) * measured.told_variance;
  measured.told_variance *= model_error_scale.value();
}

ImuNoise RadarInertialOdometry::Impl::imuNoise() const {
  ImuNoise noise = options.imu_noise;
  noise.accel_density *= std::sqrt(model_error_scale.value());
  return noise;
}

std::string RadarInertialOdometry::Impl::measureVelocity(const RadarScan& scan, bool at_rest,
                                                         EgoVelocity& measured,
                                                         std::optional<double>& held_t_O) {
  const auto prediction = smoother.predictRadarVelocity(scan.stamp, R_RI, options.T_IR.l_I);
  std::optional<VelocityPrior> prior;
  if (prediction) prior = prediction->velocity;
  if (at_rest) {
    prior = VelocityPrior();
    prior->covariance.diagonal().setConstant(options.rest.velocity_sigma * options.rest.velocity_sigma);
  }
  const bool tilt_is_known = !prediction || prediction->tilt_sigma < kMaxTiltSigma;
  const bool trust_prior = health_monitor.health() != Health::kDiverged;
  measureAt(scan, trust_prior ? prior : std::nullopt, measured);
  if (prior) judgePrediction(scan, *prior, measured);
  if (!isValid(measured.status)) return toString(measured.status);
  if (!feasibility.accept(scan.stamp, measured.v_R)) return "infeasible_velocity";
  const bool moving = !at_rest && measured.status == EgoVelocityStatus::kMoving;
  const bool informs_offset = moving && prediction && prediction->informs_offset;
  // An offset that is wrong by c shows as (J + noise) c; nothing else tells of the noise's part.
  if (informs_offset) measured.covariance.diagonal().array() += prediction->rate_variance;
  if (!informs_offset) held_t_O = prediction ? prediction->t_O : smoother.newest().t_O;
  // A minority that sides with the prediction has more noise than its covariance says.
  if (prediction && tilt_is_known && informs_offset && speaksForItself(measured) &&
      options.smoother.estimate_time_offset &&
      offset_step_detector.stepped(scan.stamp, measured.v_R - prediction->velocity.v_R,
                             prediction->covariance_at_offset + measured.covariance, prediction->dv_dt_O)) {
    smoother.loosenTimeOffset(scan.stamp);
    offset_uncertainty.offsetStepped();
    health_monitor.offsetStepped(scan.stamp);
    faults.count("time_offset_step");
  }
  if (prior && innovation_gate.rejects(scan.stamp, *prior, measured, tilt_is_known)) return "innovation";
  if (prediction && moving && tilt_is_known && speaksForItself(measured)) {
    const Eigen::Vector3d d = measured.v_R - prediction->velocity.v_R;
    const Eigen::Matrix3d S = prediction->velocity.covariance + measured.covariance;
    if (informs_offset) offset_uncertainty.add(scan.stamp, d, S, prediction->dv_dt_O);
    // The state's variance grows about as the root of the accelerometer's, unless that is measured.
    const bool accel_is_told = imuNoise().accelVariance(imu.at(scan.stamp)) > imu.at(scan.stamp).accel_noise;
    const Eigen::Matrix3d scaled = (accel_is_told ? 0.5 : 0.0) * prediction->velocity.covariance +
                                   Eigen::Matrix3d(measured.told_variance.asDiagonal());
    const Eigen::LDLT<Eigen::Matrix3d> weight = S.ldlt();
    model_error_scale.add(scan.stamp, d.dot(weight.solve(d)), weight.solve(scaled).trace() / 3.0);
  }
  return "";
}

void RadarInertialOdometry::Impl::updateWindow() {
  const SolveReport solve = smoother.optimize();
  result.solver_iterations = solve.iterations;
  result.solver_termination = solve.termination;
  for (const NodeEstimate& node : smoother.marginalize()) {
    result.left_window.push_back({node.time, node.x.p_W(), node.x.q_WI()});
  }
  const NodeMatrix covariance = smoother.newestCovariance();
  result.state = newestState(covariance);
  health_monitor.updated(result.state.time);
  result.time_offset = smoother.newest().t_O;
  result.time_offset_sigma =
      options.smoother.estimate_time_offset
          ? offset_uncertainty.sigma(covariance(StateBlock::kTangent, StateBlock::kTangent))
          : 0.0;
  anchorPropagator(result.state,
                  result.used && result.ego_velocity.status == EgoVelocityStatus::kZeroVelocity);
}

std::vector<ScanResult> RadarInertialOdometry::finish() {
  Impl& m = *impl_;
  std::vector<ScanResult> results = process();
  for (RadarScan& scan : m.waiting_scans) {
    m.finishScan(scan, true);
    results.push_back(std::move(m.result));
  }
  m.waiting_scans.clear();
  if (!initialized()) return results;
  // The poses still in the window belong to the last scan.
  if (results.empty()) results.emplace_back();
  for (const StampedPose& pose : m.left_in_silence) results.back().left_window.push_back(pose);
  m.left_in_silence.clear();
  for (std::size_t k = 0; k < m.smoother.size(); ++k) {
    const NodeEstimate node = m.smoother.node(k);
    results.back().left_window.push_back({node.time, node.x.p_W(), node.x.q_WI()});
  }
  return results;
}

void RadarInertialOdometry::Impl::drainInbox() {
  imu_drained.clear();
  bool clock_restarted = false;
  bool scan_came = false;
  {
    const std::lock_guard<std::mutex> lock(inbox_mutex);
    clock_restarted = inbox_clock_restarts != clock_restarts_done;
    clock_restarts_done = inbox_clock_restarts;
    scan_came = !scan_inbox.empty();
    std::swap(imu_drained, imu_inbox);
    for (RadarScan& scan : scan_inbox) waiting_scans.push_back(std::move(scan));
    scan_inbox.clear();
  }
  if (clock_restarted) startAgain();
  for (const ImuMeasurement& sample : imu_drained) {
    if (sample.gyro_doubt > 0.0 && smoother.size() > 0)
      yaw_doubt.add(sample.gyro_doubt * (sample.time - imu.newest()), smoother.newest().x.p_W());
    imu.add(sample);
    if (smoother.size() == 0 && !sample.is_bridge) tryInitialize(sample);
  }
  watchRadar(scan_came);
  if (smoother.size() == 0) return;
  carryWindow();
  const bool keep_for_recovery = options.health.on_divergence == OnDivergence::kReinitialize;
  const Time needed = smoother.imuNeededSince();
  imu.dropBefore(keep_for_recovery ? std::min(needed, imu.newest() - recovery.imuHistory()) : needed);
}

/// The IMU's clock jumped: nothing before can be related to what comes. The scans that wait are rejected, as
/// those before an initialisation.
void RadarInertialOdometry::Impl::startAgain() {
  imu.clear();
  // Nobody stands still because a clock jumped.
  OdometryOptions at_once = options;
  at_once.init_motion_after = 0.0;
  initializer = Initializer(at_once);
  feasibility = FeasibilityCheck(options.feasibility);
  offset_step_detector = OffsetStepDetector(options.offset_step_detector);
  offset_uncertainty = OffsetUncertainty(options.smoother.huber_threshold);
  model_error_scale = ModelErrorScale();
  smoother = emptySmoother();
  left_in_silence.clear();
  recovery.clear();
  health_monitor = HealthMonitor(options.health, options.smoother.innovation_gate);
  pose_doubt = PoseDoubt();
  radar_heard.reset();
}

/// Counts times without radar, by the IMU's clock at the arrival of scans: the scans' own stamps may be
/// wrong.
void RadarInertialOdometry::Impl::watchRadar(bool scan_came) {
  if (imu.empty()) return;
  if (scan_came || !radar_heard) {
    radar_heard = imu.newest();
    radar_is_silent = false;
  } else if (!radar_is_silent && imu.newest() - *radar_heard > options.max_radar_gap) {
    faults.count("radar_gap");
    radar_is_silent = true;
  }
}

/// Of a silent radar, see kSilentStep.
void RadarInertialOdometry::Impl::carryWindow() {
  const Time time = imu.newest() - (kLateScan + 2.0 * options.smoother.max_time_offset);
  if (!waiting_scans.empty() || time - smoother.newest().time < kSilentStep) return;
  smoother.carryTo(time);
  smoother.optimize();
  for (const NodeEstimate& node : smoother.marginalize())
    left_in_silence.push_back({node.time, node.x.p_W(), node.x.q_WI()});
}

void RadarInertialOdometry::Impl::anchorPropagator(const NavigationState& state, bool at_rest) {
  const std::lock_guard<std::mutex> lock(navigation_mutex);
  // Else the propagator lives already in another time.
  if (clock_restarts != clock_restarts_done) return;
  propagator.setNoise(imuNoise());
  propagator.anchor(state, at_rest);
}

void RadarInertialOdometry::Impl::tryInitialize(const ImuMeasurement& sample) {
  const std::optional<Initialization> found = initializer.add(sample, imu);
  if (found) {
    start = found;
    model_error_scale = found->model_error_scale;
    begin(found->time, found->prior);
  } else {
    imu.dropBefore(sample.time - initializer.imuHistory());
  }
  const std::lock_guard<std::mutex> lock(inbox_mutex);
  is_initialized = found.has_value();
  waiting_for = initializer.waitingFor();
}

void RadarInertialOdometry::Impl::begin(Time time, const NodePrior& prior) {
  smoother.initialize(time, prior);
  yaw_doubt = YawDoubt();
  initialized_at = time;
  innovation_gate.used(time);
  health_monitor.startedAt(time);
  publishNewest();
}

void RadarInertialOdometry::Impl::publishNewest() {
  anchorPropagator(newestState(smoother.newestCovariance()));
}

bool RadarInertialOdometry::Impl::tryReinitialize(std::vector<StampedPose>& left) {
  const auto found = recovery.solve(imu, [this](Time time) { return anchorAt(time); });
  if (!found) return false;
  for (std::size_t k = 0; k < smoother.size(); ++k) {
    const NodeEstimate node = smoother.node(k);
    if (node.time < found->time) left.push_back({node.time, node.x.p_W(), node.x.q_WI()});
  }
  pose_doubt = PoseDoubt(newestState(smoother.newestCovariance()));
  model_error_scale = found->model_error_scale;
  begin(found->time, found->prior);
  offset_step_detector = OffsetStepDetector(options.offset_step_detector);
  offset_uncertainty = OffsetUncertainty(options.smoother.huber_threshold);
  updateHealth();
  faults.count("reinitialized");
  return true;
}

PoseAnchor RadarInertialOdometry::Impl::anchorAt(Time time) const {
  // From the newest node before, as the propagator goes: what is published goes on from where it is.
  std::size_t k = smoother.size() - 1;
  while (k > 0 && smoother.node(k).time > time) --k;
  const NodeEstimate node = smoother.node(k);
  StateBlock x = node.x;
  if (node.time < time)
    x = predict(x, preintegrate(imu, node.time, time, x.b_g(), x.b_a(), options.imu_noise), g_W);
  PoseAnchor anchor;  // how well it is known is kept by pose_doubt
  anchor.q_WI = x.q_WI();
  anchor.p_W = x.p_W();
  anchor.sigma_yaw = options.smoother.prior_sigma_yaw;
  anchor.sigma_position = options.smoother.prior_sigma_position;
  return anchor;
}

void RadarInertialOdometry::Impl::updateHealth() {
  std::optional<NavigationState> state;
  {
    const std::lock_guard<std::mutex> lock(navigation_mutex);
    state = propagator.state();
  }
  if (!state || imu.empty()) return;
  const bool was_diverged = health_monitor.health() == Health::kDiverged;
  const Health now = health_monitor.judge(imu.newest(), *state);
  if (now == Health::kDiverged && !was_diverged) faults.count("diverged");
  const std::lock_guard<std::mutex> lock(inbox_mutex);
  health = now;
}

bool RadarInertialOdometry::Impl::isAtRest(Time time) const {
  const NodeEstimate newest = smoother.newest();
  return rio_t::isAtRest(imu, time, {newest.x.q_WI(), newest.x.v_W(), newest.x.b_g(), newest.x.b_a(), g_W},
                         options.rest);
}

void RadarInertialOdometry::Impl::judgePrediction(const RadarScan& scan, const VelocityPrior& prior,
                                                  const EgoVelocity& measured) {
  // Where few points agree, they may be those that side with a wrong prediction: what says the scan alone?
  if (!speaksForItself(measured)) measureAt(scan, std::nullopt, velocity_alone);
  const EgoVelocity& alone = speaksForItself(measured) ? measured : velocity_alone;
  if (!speaksForItself(alone)) return health_monitor.addUndecided(scan.stamp);
  // A crowd may outnumber the static world. What then sides with the prediction alone is its witness: noise
  // does not give so many of them.
  const bool is_outvoted = countOthers(measured.inliers, alone.inliers) >= options.ego_velocity.min_inliers;
  if (is_outvoted && !isValid(measured.status)) return health_monitor.addUndecided(scan.stamp);
  const EgoVelocity& judge = is_outvoted ? measured : alone;
  if (!is_outvoted) recovery.add(scan.stamp, alone);
  health_monitor.addInnovation(scan.stamp, judge.v_R - prior.v_R, innovation_gate.covariance(prior, judge));
}

NavigationState RadarInertialOdometry::Impl::newestState(const NodeMatrix& covariance) const {
  NavigationState state = navigationState(smoother.newest(), covariance, imu);
  yaw_doubt.addTo(state);
  pose_doubt.addTo(state);
  health_monitor.widen(state);
  return state;
}

bool RadarInertialOdometry::initialized() const {
  const std::lock_guard<std::mutex> lock(impl_->inbox_mutex);
  return impl_->is_initialized;
}

std::optional<RadarInertialOdometry::Start> RadarInertialOdometry::start() const { return impl_->start; }

PointVariances RadarInertialOdometry::radarNoise() const { return impl_->ego_velocity_estimator.noise(); }

MeasuredImuNoise RadarInertialOdometry::imuNoise() const {
  const std::lock_guard<std::mutex> lock(impl_->navigation_mutex);
  return impl_->imu_input_check.noise();
}

Health RadarInertialOdometry::health() const {
  const std::lock_guard<std::mutex> lock(impl_->inbox_mutex);
  return impl_->health;
}

std::string RadarInertialOdometry::waitingFor() const {
  const std::lock_guard<std::mutex> lock(impl_->inbox_mutex);
  return impl_->waiting_for;
}

std::map<std::string, std::uint64_t> RadarInertialOdometry::faults() const { return impl_->faults.get(); }

}  // namespace rio_t
