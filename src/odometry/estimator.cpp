#include "rio_t/odometry/estimator.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "rio_t/factors/imu_factor.h"
#include "rio_t/factors/radar_motion.h"

namespace rio_t {
namespace {

/// The IMU must be this far past a scan's node [s]: the derivative with respect to t_O averages so far ahead,
/// and the time of the factor may still move a little.
constexpr double kImuMargin = kOffsetHalfWidth + 0.01;
/// [s] A scan stamped further ahead of the newest IMU sample has a wrong stamp, unless the IMU is in a gap
/// that will be bridged.
constexpr double kMaxStampAhead = 1.0;
/// [s] Without scans the window moves on in steps of kSilentStep, because the IMU buffer must not grow
/// without end. It stays kLateScan behind, for late scans.
constexpr double kSilentStep = 5.0;
constexpr double kLateScan = 1.0;

std::vector<RadarChannel> radarChannels(const OdometryOptions& options, const Eigen::Vector3d& g_W,
                                        const ImuBuffer& imu) {
  const auto shared = options.smoother.time_offset_shared
                          ? std::make_shared<OffsetBlocks>(options.smoother, options.ofRadar(0))
                          : nullptr;
  std::vector<RadarChannel> channels;
  for (std::size_t k = 0; k < options.radarCount(); ++k) {
    const RadarChannelOptions channel{options.ofRadar(k), options.innovation_gate,
                                      options.offset_step_detector, options.smoother};
    channels.emplace_back(channel, g_W, imu, shared);
  }
  return channels;
}

/// Adds a walk. If radars share a block, it gets only one walk, the largest.
void addWalk(std::vector<FixedLagSmoother::RandomWalk>& walks, const FixedLagSmoother::RandomWalk& walk) {
  for (FixedLagSmoother::RandomWalk& other : walks) {
    if (other.block != walk.block) continue;
    other.density = other.density.cwiseMax(walk.density);
    return;
  }
  walks.push_back(walk);
}

StampedPose pose(const NodeEstimate& node) { return {node.time, node.x.p_W(), node.x.q_WI()}; }

}  // namespace

Estimator::Estimator(const OdometryOptions& options, Navigation& navigation, FaultCounters& faults)
    : options_(options),
      g_W_(0.0, 0.0, -options.gravity),
      max_stamp_ahead_(std::max(kMaxStampAhead, options.imu_input_check.max_bridged_gap)),
      navigation_(navigation),
      faults_(faults),
      initializer_(options),
      smoother_(options.smoother, options.imu_noise, g_W_, imu_),
      radars_(radarChannels(options, g_W_, imu_)),
      calibration_check_(options.radarCount()),
      health_(options.health, options.innovation_gate.sigmas, options.radarCount()),
      waiting_for_(initializer_.waitingFor()) {
  if (options.platform == Platform::kGroundVehicle)
    ground_vehicle_.emplace(options.ground_vehicle, options.smoother.huber_threshold, imu_);
  if (options.use_barometer) barometer_.emplace(options.barometer);
  if (options.landmarks.enabled) landmarks_.emplace(options.landmarks, g_W_, imu_);
}

/// Before the start, the scan helps to find the start. Then it goes into the window, if its time allows.
ScanResult Estimator::useScan(RadarScan scan, bool imu_has_ended) {
  ScanResult result;
  result.scan = std::move(scan);
  result.left_window = std::exchange(left_between_, {});
  const Time stamp = result.scan.stamp;
  RadarChannel& radar = radars_.at(result.scan.radar);
  const bool had_span = radar.knowledge().doppler_span.value > 0.0;
  const bool is_new = radar.observe(result.scan);
  // The velocities so far are wrong: they were computed without the span, or with a wrong one.
  if ((radar.knowledge().doppler_span.value > 0.0) != had_span) initializer_.forgetVelocities();
  if (!initialized()) {
    result.ego_velocity = radar.velocityOf(result.scan);
    if (is_new) initializer_.addVelocity(result.scan.radar, stamp, result.ego_velocity);
    result.rejected_because = "before_initialization";
    return result;
  }
  // This comes first, because a new start may move the offset and with it the time of measurement.
  if (health_.wantsReinitialization(imu_.newest()))
    result.reinitialized = tryReinitialize(result.left_window);
  const Time node_time = radar.nodeTime(stamp);
  result.rejected_because = is_new ? whyNotNow(node_time, imu_has_ended) : "scan_repeated";
  if (result.rejected_because.empty()) putIntoWindow(node_time, radar, result);
  result.health = health_.health();
  result.is_contradicted = health_.isContradicted();
  return result;
}

void Estimator::putIntoWindow(Time node_time, RadarChannel& radar, ScanResult& result) {
  const Time stamp = result.scan.stamp;
  result.model_error_scale = model_error_scale_.value();
  smoother_.setImuNoise(imuNoise());
  const StateBlock x = smoother_.newest().x;
  const std::optional<Rest> rest =
      findRest(imu_, node_time, {x.q_WI(), x.v_W(), x.b_g(), x.b_a(), g_W_}, options_.rest);
  const bool is_still = rest && !rest->shakes;
  const bool has_diverged = health_.health() == Health::kDiverged;
  // These come before the radar adds its node, because a new node has no estimate yet.
  if (barometer_) result.barometer = barometer_->use(smoother_);
  if (ground_vehicle_ && !is_still) result.ground_vehicle = ground_vehicle_->judge(smoother_, node_time);
  std::optional<LandmarkMap::Prediction> expected;
  if (landmarks_) expected = landmarks_->predict(smoother_, stamp - radar.offset(), radar.extrinsicsBlock());
  const RadarAnswer answer = radar.use(
      result.scan, {rest, has_diverged, health_.isContradicted(), result.model_error_scale, last_used_},
      smoother_);
  judge(answer, result.scan);
  static_cast<ScanAnswer&>(result) = static_cast<const ScanAnswer&>(answer);
  result.used = result.updated = answer.rejected_because.empty();
  if (result.used) last_used_ = stamp;
  if (expected && result.used) seeLandmarks(*expected, answer, radar, result);
  bool rests_now = false;
  if (answer.at_rest) {
    if (Block* node = smoother_.nodeAt(radar.nodeTime(stamp))) {
      rests_now = *node->time == smoother_.newest().time;  // a late scan shows a rest that may be over
      result.rest_velocity_sigma = rest->velocity_sigma;
      smoother_.addZeroVelocity(*node, rest->velocity_sigma);
      result.updated = true;
    }
  }
  // The constraint of a vehicle holds whether or not a scan is used, but it is no sign that the radar
  // works.
  const bool by_radar = result.updated;
  if (result.ground_vehicle) constrainToGround(answer.at_rest, result);
  if (result.updated) updateWindow(radar, rests_now, result);
  if (by_radar) health_.updated(result.state.time);
  updateHealth();
  if (!result.updated && health_.health() == Health::kDiverged) publishNewest();
}

void Estimator::constrainToGround(bool at_rest, ScanResult& result) {
  GroundVehicleAnswer& vehicle = *result.ground_vehicle;
  if (vehicle.is_contradicted) faults_.count("ground_vehicle_contradicted");
  vehicle.used = !at_rest && ground_vehicle_->add(vehicle, smoother_);
  if (vehicle.used) result.updated = true;
}

std::string Estimator::whyNotNow(Time node_time, bool imu_has_ended) const {
  if (node_time < initialized_at_) return "before_initialization";
  if (node_time - imu_.newest() > max_stamp_ahead_) return "stamp_ahead_of_imu";
  if (imu_.covers(imu_has_ended ? node_time : node_time + kImuMargin)) return "";
  return node_time < imu_.oldest() ? "older_than_window" : "imu_not_covering";
}

/// Passes the innovations of the scan to health, recovery, the scale of the model errors and the check of the
/// calibration.
void Estimator::judge(const RadarAnswer& answer, const RadarScan& scan) {
  HealthMonitor& health = health_.of(scan.radar);
  if (answer.innovation) {
    health.addInnovation(*answer.innovation);
  } else if (answer.was_predicted) {
    health.addUndecided(scan.stamp);
  }
  if (answer.alone) initializer_.addVelocity(scan.radar, scan.stamp, *answer.alone);
  if (answer.offset_stepped) {
    health.offsetStepped(scan.stamp);
    faults_.count("time_offset_step");
  }
  if (answer.at_rest) calibration_check_.velocityKnown();
  if (!answer.used) return;
  if (!health_.isContradicted()) calibration_check_.add(scan.radar, *answer.used);
  // The state's variance grows about as the root of the accelerometer's.
  Eigen::Matrix3d scaled = 0.5 * answer.used->predicted;
  scaled.diagonal() += answer.ego_velocity.added_variance;
  const double share = answer.used->S.ldlt().solve(scaled).trace() / 3.0;
  model_error_scale_.add(scan.stamp, answer.used->squaredSigmas(), share);
}

/// Skips scans at rest, since they repeat the errors of one scan.
void Estimator::seeLandmarks(const LandmarkMap::Prediction& expected, const RadarAnswer& answer,
                             const RadarChannel& radar, ScanResult& result) {
  Block* node = smoother_.nodeAt(radar.nodeTime(result.scan.stamp));
  if (node == nullptr || answer.at_rest || answer.ego_velocity.status != EgoVelocityStatus::kMoving) return;
  const EgoVelocityOptions& own = options_.ofRadar(result.scan.radar).ego_velocity;
  const PointVariances noise = radar.knowledge().noise;
  // The noise that the Dopplers show does not contain how far an echo wanders over an object.
  const double azimuth_sigma = std::max(own.azimuth_sigma, std::sqrt(noise.azimuth));
  const double elevation_sigma = std::max(own.elevation_sigma, std::sqrt(noise.elevation));
  constexpr double kMinLevel = 0.5;  // steeper than 60 degrees, an azimuth is hardly defined
  std::vector<Detection> detections;
  for (const std::size_t i : answer.ego_velocity.inliers) {
    const RadarPoint& point = result.scan.points[i];
    if (point.position_R.head<2>().norm() < kMinLevel * point.position_R.norm()) continue;
    detections.push_back(
        {{point.position_R, options_.landmarks.range_sigma, azimuth_sigma, elevation_sigma}, point.snr_db});
  }
  result.landmarks = landmarks_->use(expected, detections, *node, radar.extrinsicsBlock(), smoother_);
  if (result.landmarks->dropped_map) faults_.count("landmarks_dropped");
}

void Estimator::updateWindow(const RadarChannel& radar, bool rests_now, ScanResult& result) {
  const Eigen::Vector3d predicted_W = smoother_.newest().x.v_W();
  const Solution& solution = smoother_.optimize();
  corrected_W_ += smoother_.newest().x.v_W() - predicted_W;
  result.solver_iterations = solution.iterations;
  result.solver_termination = solution.termination;
  constexpr int kState = StateBlock::kTangent;
  const Eigen::MatrixXd covariance = smoother_.newestCovariance(radar.calibration());
  result.state = newestState(covariance.topLeftCorner<kState, kState>());
  const Eigen::Index estimated = covariance.rows() - (kState + 1);  // of the mounting
  result.time_offset = radar.offset();
  result.time_offset_sigma = radar.offsetSigma(covariance(kState, kState));
  result.T_IR = radar.extrinsics();
  result.configured_T_IR = radar.configuredExtrinsics();
  const EstimateExtrinsics estimate = options_.smoother.estimate_extrinsics;
  result.errors = calibration_check_.errorsOf(result.scan.radar, result.configured_T_IR);
  if (estimatesTurn(estimate)) result.errors.turn.reset();
  if (estimatesLeverArm(estimate)) result.errors.lever_arm.reset();
  if (options_.smoother.estimate_time_offset) result.errors.offset.reset();
  result.T_IR_covariance = extrinsicsCovariance(covariance.bottomRightCorner(estimated, estimated), estimate);
  marginalize(result.left_window);
  // On a frame that shakes, the zero velocity has a large sigma in the window: the start of a gentle drive
  // must not look like an offset. The published velocity is zero.
  if (rests_now) result.state.v_W.setZero();
  anchor(result.state, rests_now);
  addHeadingCurvature(result.state);
}

void Estimator::marginalize(std::vector<StampedPose>& left) {
  std::vector<FixedLagSmoother::RandomWalk> walks;
  const auto addWalksOf = [&](const auto& channel) {
    for (const FixedLagSmoother::RandomWalk& walk : channel.randomWalks()) addWalk(walks, walk);
  };
  for (const RadarChannel& radar : radars_) addWalksOf(radar);
  if (ground_vehicle_) addWalksOf(*ground_vehicle_);
  if (barometer_) addWalksOf(*barometer_);
  for (const NodeEstimate& node : smoother_.marginalize(walks)) left.push_back(pose(node));
}

Time Estimator::nodeTime(const RadarScan& scan) const { return radars_.at(scan.radar).nodeTime(scan.stamp); }

bool Estimator::mustWait(const RadarScan& scan) const {
  if (imu_.empty()) return false;
  const Time node_time = nodeTime(scan);
  const double ahead = node_time - imu_.newest();
  if (ahead > max_stamp_ahead_) return false;
  // The sample that starts the estimate may still be on its way.
  if (!initialized()) return ahead > 0.0;
  return node_time >= initialized_at_ && ahead > -kImuMargin;
}

void Estimator::addImu(const std::vector<ImuMeasurement>& samples) {
  for (const ImuMeasurement& sample : samples) {
    imu_.add(sample);
    if (!initialized() && !sample.is_bridge) tryInitialize(sample);
  }
}

void Estimator::tune(const Tuning& tuning) {
  apply(tuning, options_);
  for (RadarChannel& radar : radars_) radar.setGate(options_.innovation_gate);
  initializer_.setImuNoise(options_.imu_noise);
  health_.setGate(options_.innovation_gate.sigmas);
}

void Estimator::addPressure(const Pressure& pressure) {
  if (!barometer_ || imu_.empty()) return;
  if (const char* fault = barometer_->add(pressure, imu_.newest())) faults_.count(fault);
}

void Estimator::keepUp(bool scan_came, const std::vector<RadarScan>& waiting) {
  if (imu_.empty()) return;
  // A gap is measured by the IMU's clock at the arrival of scans, since their stamps may be wrong.
  if (scan_came || !radar_heard_) {
    radar_heard_ = imu_.newest();
    radar_is_silent_ = false;
  } else if (!radar_is_silent_ && imu_.newest() - *radar_heard_ > options_.max_radar_gap) {
    faults_.count("radar_gap");
    radar_is_silent_ = true;
  }
  if (!initialized()) return;
  const Time time = imu_.newest() - (kLateScan + 2.0 * options_.smoother.max_time_offset);
  const bool precedes_all = std::none_of(waiting.begin(), waiting.end(),
                                         [&](const RadarScan& scan) { return nodeTime(scan) <= time; });
  if (precedes_all && time - smoother_.newest().time >= kSilentStep) {
    smoother_.nodeAt(time);
    smoother_.optimize();
    marginalize(left_between_);
  }
  const bool keep_for_recovery = options_.health.on_divergence == OnDivergence::kReinitialize;
  const Time needed = smoother_.imuNeededSince();
  const Time recovery = imu_.newest() - initializer_.imuHistory();
  imu_.dropBefore(keep_for_recovery ? std::min(needed, recovery) : needed);
}

void Estimator::startAgain(std::uint64_t clock_restarts) {
  clock_restarts_ = clock_restarts;
  left_between_ = remainingPoses();
  start_.reset();
  imu_.clear();
  if (barometer_) barometer_->startAgain();
  // The platform may be moving, so a start in motion need not wait.
  OdometryOptions at_once = options_;
  at_once.init_motion_after = 0.0;
  initializer_ = Initializer(at_once);
  smoother_ = FixedLagSmoother(options_.smoother, options_.imu_noise, g_W_, imu_);
  health_ = RadarsHealth(options_.health, options_.innovation_gate.sigmas, radars_.size());
  radar_heard_.reset();
}

void Estimator::tryInitialize(const ImuMeasurement& sample) {
  const std::optional<Initialization> found = initializer_.add(sample, imu_);
  waiting_for_ = initializer_.waitingFor();
  if (!found) return imu_.dropBefore(sample.time - initializer_.imuHistory());
  start_ = found;
  begin(*found);
}

void Estimator::begin(const Initialization& found) {
  const bool at_rest = found.from == InitializedFrom::kRest;
  radars_[found.radar].start(smoother_, found.time, found.prior);
  for (std::size_t k = 0; k < radars_.size(); ++k)
    if (k != found.radar) radars_[k].join(smoother_);
  if (ground_vehicle_) ground_vehicle_->join(smoother_, at_rest);
  if (barometer_) barometer_->join(smoother_, found.time, at_rest);
  initializer_.forgetVelocities();
  model_error_scale_ = found.model_error_scale;
  calibration_check_.velocityKnown();
  last_used_ = found.time;
  contradicted_since_ = found.time;
  corrected_W_.setZero();
  if (landmarks_) landmarks_->forget();
  initialized_at_ = found.time;
  health_.startedAt(found.time);
  publishNewest();
}

/// The poses of the window that is given up go to `left`.
bool Estimator::tryReinitialize(std::vector<StampedPose>& left) {
  const std::optional<Initialization> found =
      initializer_.findInMotion(imu_, [this](Time time) { return anchorAt(time); });
  if (!found) return false;
  for (const NodeEstimate& node : smoother_.nodes())
    if (node.time < found->time) left.push_back(pose(node));
  begin(*found);
  updateHealth();
  faults_.count("reinitialized");
  return true;
}

PoseAnchor Estimator::anchorAt(Time time) const {
  // The IMU carries the newest node before `time`, as in Navigation, so that the published pose does not
  // jump.
  const Time since = std::max(time, smoother_.node(0).time);
  const PredictedState predicted = *smoother_.predict(since, {});
  const bool is_before = time < since;  // earlier than the first node
  const StateBlock x = is_before ? carried(predicted.x, since, time, imu_, g_W_) : predicted.x;
  NavigationState state = navigationState({time, x}, predicted.covariance, imu_);
  health_.widen(state);
  const auto E = poseInW(state.q_WI);
  return {state.q_WI, state.p_W, E * state.covariance * E.transpose()};
}

Health Estimator::updateHealth() {
  const std::optional<NavigationState> state = navigation_.state();
  if (!state || imu_.empty()) return health_.health();
  const bool was_diverged = health_.health() == Health::kDiverged;
  const bool was_contradicted = health_.isContradicted();
  const Health now = health_.judge(imu_.newest(), *state, model_error_scale_.value());
  if (now == Health::kDiverged && !was_diverged) faults_.count("diverged");
  followContradiction(was_contradicted);
  return now;
}

/// If the estimate was wrong, the scans have corrected its velocity by the error; if it was right, by
/// nothing. The position has drifted with this error of the velocity, and no scan corrects the position.
void Estimator::followContradiction(bool was_contradicted) {
  const bool is_contradicted = health_.isContradicted();
  if (is_contradicted && !was_contradicted) {
    contradicted_since_ = imu_.newest() - options_.health.window;
    corrected_W_.setZero();
  } else if (was_contradicted && !is_contradicted) {
    const double seconds = imu_.newest() - contradicted_since_;
    smoother_.addDrift(corrected_W_.squaredNorm() * seconds * seconds);
  }
}

void Estimator::anchor(const NavigationState& state, bool at_rest) {
  navigation_.anchor(state, at_rest, imuNoise(), imu_.oldest(), clock_restarts_);
}

std::vector<StampedPose> Estimator::remainingPoses() {
  std::vector<StampedPose> poses = std::exchange(left_between_, {});
  for (const NodeEstimate& node : smoother_.nodes()) poses.push_back(pose(node));
  return poses;
}

NavigationState Estimator::newestState(const StateCovariance& covariance) const {
  NavigationState state = navigationState(smoother_.newest(), covariance, imu_);
  health_.widen(state);
  return state;
}

}  // namespace rio_t
