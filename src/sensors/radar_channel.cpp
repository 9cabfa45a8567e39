#include "rio_t/sensors/radar_channel.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

namespace rio_t {
namespace {

/// [rad] If roll and pitch are less certain than this, the prediction is not linear in them, and its
/// covariance is too small to reject anything.
constexpr double kMaxTiltSigma = 0.1;
/// [m/s] Sigma of a velocity that no point of a scan sees.
constexpr double kUnseen = 100.0;

/// Counts the elements of `some` that are not in `others`; both ascend.
std::size_t countOthers(const std::vector<std::size_t>& some, const std::vector<std::size_t>& others) {
  return static_cast<std::size_t>(std::count_if(some.begin(), some.end(), [&](std::size_t index) {
    return !std::binary_search(others.begin(), others.end(), index);
  }));
}

std::vector<std::size_t> below(std::size_t limit, const std::vector<std::size_t>& ascending) {
  return {ascending.begin(), std::lower_bound(ascending.begin(), ascending.end(), limit)};
}

/// Without the points that the scan borrowed: they follow its own (see ScanPool).
EgoVelocity withOwnPoints(EgoVelocity velocity, const RadarScan& scan) {
  velocity.points = below(scan.points.size(), velocity.points);
  velocity.inliers = below(scan.points.size(), velocity.inliers);
  return velocity;
}

/// Multiplies the added variance by `factor`.
EgoVelocity scaled(EgoVelocity velocity, double factor) {
  velocity.covariance.diagonal() += (factor - 1.0) * velocity.added_variance;
  velocity.added_variance *= factor;
  return velocity;
}

VelocityPrior zeroVelocity(double sigma) {
  return {Eigen::Vector3d::Zero(), sigma * sigma * Eigen::Matrix3d::Identity()};
}

}  // namespace

RadarChannel::RadarChannel(const RadarChannelOptions& options, const Eigen::Vector3d& g_W,
                           const ImuBuffer& imu, std::shared_ptr<OffsetBlocks> offset)
    : options_(options),
      estimator_(options.radar.ego_velocity),
      in_window_(
          options.smoother, options.radar, g_W, imu,
          offset ? std::move(offset) : std::make_shared<OffsetBlocks>(options.smoother, options.radar)),
      offset_widths_(imu, g_W),
      step_detector_(options.offset_step_detector, options.smoother.max_time_offset),
      offset_uncertainty_(options.smoother.huber_threshold) {}

void RadarChannel::start(FixedLagSmoother& smoother, Time time, const NodePrior& prior) {
  in_window_.start(smoother, time, prior);
  forget();
}

void RadarChannel::join(FixedLagSmoother& smoother) {
  in_window_.join(smoother);
  forget();
}

void RadarChannel::forget() {
  forgetOffset();
  offset_widths_.clear();
  memory_ = {};
}

void RadarChannel::forgetOffset() {
  offset_steps_ = in_window_.offsetSteps();
  step_detector_ = OffsetStepDetector(options_.offset_step_detector, options_.smoother.max_time_offset);
  offset_uncertainty_ = OffsetUncertainty(options_.smoother.huber_threshold);
}

void RadarChannel::followOffsetSteps() {
  if (offset_steps_ != in_window_.offsetSteps()) forgetOffset();
}

RadarAnswer RadarChannel::use(const RadarScan& scan, const ScanContext& context, FixedLagSmoother& smoother) {
  RadarAnswer answer;
  const auto reject = [&](const std::string& reason) {
    answer.rejected_because = reason;
    return answer;
  };
  followOffsetSteps();
  // This comes first, so that no point counts twice for health or in a pool.
  if (in_window_.has(scan.stamp) || memory_.judged_at == scan.stamp) return reject("duplicate_stamp");
  memory_.judged_at = scan.stamp;
  Seen seen = see(scan, context, smoother, answer);
  if (!isValid(seen.velocity.status)) return reject(toString(answer.ego_velocity.status));
  // The velocity comes from borrowed points alone.
  const char* const not_own = answer.ego_velocity.points.empty() ? "too_few_points" : "too_few_inliers";
  if (seen.has_borrowed && answer.at_rest && answer.ego_velocity.inliers.empty()) return reject(not_own);
  informOffset(seen, answer);
  answer.taken.stamp = scan.stamp;
  answer.taken.linear_from_t_O = std::make_shared<const double>(offset());
  if (isTightlyCoupled() && seen.velocity.status == EgoVelocityStatus::kMoving) {
    answer.doppler = dopplerOf(scan, seen, answer);
    if (!answer.doppler) return reject(not_own);
  }

  Innovations d;
  if (seen.prior) d.all = innovation(scan.stamp, *seen.prior, seen.velocity, &seen);
  if (answer.taken.offset_gain > 0.0) d.own = ownInnovation(scan, seen);
  if (d.own) answer.offset_stepped = step_detector_.stepped(*d.own, seen.prediction->scan.R_WR(), offset());
  if (answer.offset_stepped) {
    const Time covered = nodeTime(scan.stamp);
    in_window_.stepOffset(smoother, *answer.offset_stepped, covered);
    followOffsetSteps();
    // With a smaller offset the scan was measured later, where the IMU may not reach yet.
    if (nodeTime(scan.stamp) > covered) return reject("imu_not_covering");
  }
  if (d.all &&
      memory_.gate.rejects(options_.gate, *d.all, seen.velocity, seen.tilt_is_known, context.last_used))
    return reject("innovation");
  const bool added = answer.doppler
                         ? in_window_.add(smoother, *answer.doppler)
                         : in_window_.add(smoother, RadarVelocityMeasurement{answer.taken, seen.velocity.v_R,
                                                                             seen.velocity.covariance});
  if (!added) return reject("older_than_window");
  memory_.gate.used();
  learn(scan, seen, d, answer);
  return answer;
}

void RadarChannel::informOffset(Seen& seen, RadarAnswer& answer) {
  answer.taken.offset_gain = offsetGain(seen);
  if (seen.moves && offset_widths_.gain() > 0.0) answer.taken.slow_half_width = seen.dv_dt_O.half_width;
  if (answer.taken.offset_gain == 0.0) return;
  answer.taken.offset_half_width = seen.dv_dt_O.half_width;
  const Eigen::Vector3d J = answer.taken.offset_gain * seen.dv_dt_O.mean;
  answer.offset_information = J.dot(seen.velocity.covariance.ldlt().solve(J));
}

std::optional<DopplerMeasurement> RadarChannel::dopplerOf(const RadarScan& scan, const Seen& seen,
                                                          const RadarAnswer& answer) const {
  const EgoVelocity world = staticWorld(scan, seen);
  if (world.inliers.empty()) return std::nullopt;
  return DopplerMeasurement{
      answer.taken,
      std::make_shared<DopplerLikelihood>(estimator_.likelihood(scan, world.inliers, world.v_R)),
      seen.velocity.added_variance, options_.smoother.huber_threshold};
}

std::optional<Innovation> RadarChannel::ownInnovation(const RadarScan& scan, const Seen& seen) const {
  if (!seen.canBeJudged()) return std::nullopt;
  EgoVelocity own = seen.velocity;
  if (seen.has_borrowed) own = around(*seen.prior, scan, seen.velocity);
  if (!isValid(own.status)) return std::nullopt;
  return innovation(scan.stamp, *seen.prior, own, &seen);
}

void RadarChannel::learn(const RadarScan& scan, const Seen& seen, const Innovations& d, RadarAnswer& answer) {
  // The innovation of the scan that shows a step refers to the offset before the step.
  if (d.own && !answer.offset_stepped) offset_uncertainty_.add(*d.own);
  if (seen.moves) {
    OffsetScan followed = seen.prediction->scan;
    followed.measured = seen.velocity.covariance;
    step_detector_.follow(scan.stamp, offset_widths_.gain() * seen.dv_dt_O.mean, followed);
  }
  // A borrowed point must not count twice.
  if (!seen.is_own || sharesPoints(seen, memory_.learned_at)) return;
  if (seen.canBeJudged()) {
    const OffsetScan& predicted = seen.prediction->scan;
    answer.used = UsedInnovation{*d.all,
                                 seen.velocity.v_R,
                                 seen.prior->covariance,
                                 predicted.R_WR(),
                                 predicted.T_IR.R_RI() * seen.dv_dt_O.omega_I,
                                 seen.dv_dt_O.omega_variance};
  }
  if (answer.at_rest) return;
  const DopplerLikelihood* world =
      answer.doppler && !seen.has_borrowed ? answer.doppler->points.get() : nullptr;
  estimator_.learn(seen.pooled, seen.velocity, seen.prior, world);
  memory_.learned_at = scan.stamp;
}

RadarChannel::Seen RadarChannel::see(const RadarScan& scan, const ScanContext& context,
                                     const FixedLagSmoother& smoother, RadarAnswer& answer) {
  Seen seen;
  seen.prediction = in_window_.predict(smoother, scan.stamp);
  if (seen.prediction) seen.prior = seen.prediction->velocity;
  seen.tilt_is_known = !seen.prediction || seen.prediction->tilt_sigma < kMaxTiltSigma;
  const auto velocityAt = [&](Time stamp) { return in_window_.velocityAt(smoother, stamp); };
  seen.pooled = isTightlyCoupled() ? memory_.pool.filled(scan, velocityAt) : scan;
  seen.borrowed_since = scan.stamp - ScanPool::kMaxAge;
  const double scale = context.model_error_scale;
  if (!context.rest) memory_.rest_pool = {};
  if (context.rest) answer.at_rest = confirmsRest(*context.rest, scan, scale, seen);
  seen.has_borrowed = seen.pooled.points.size() > scan.points.size();
  if (answer.at_rest) seen.prior = zeroVelocity(context.rest->velocity_sigma);

  std::optional<VelocityPrior> expected = seen.prior;
  if (context.has_diverged) expected.reset();
  // Few and coarse points agree with many velocities. The wider prior keeps them from all agreeing with a
  // prediction that is a little wrong.
  const double sigma = options_.gate.model_error;
  if (expected && seen.has_borrowed) expected->covariance.diagonal().array() += sigma * sigma;
  answer.ego_velocity = measure(seen.pooled, expected, scale);
  answer.was_predicted = seen.prior.has_value();
  if (seen.prior) judge(seen.pooled, *seen.prior, expected.has_value(), scale, answer);
  if (answer.alone && sharesPoints(seen, memory_.alone_at)) answer.alone.reset();
  if (answer.alone) memory_.alone_at = scan.stamp;

  seen.velocity = answer.ego_velocity;
  answer.ego_velocity = withOwnPoints(std::move(answer.ego_velocity), scan);
  seen.is_own = isValid(seen.velocity.status);
  if (!seen.is_own && isTightlyCoupled() && seen.prior && !context.is_contradicted) {
    EgoVelocity consensus = estimator_.around(seen.pooled, *seen.prior);
    consensus.added_variance *= scale;
    seen.velocity = around(*seen.prior, scan, consensus);
  }
  seen.moves = seen.prediction && !answer.at_rest && seen.velocity.status == EgoVelocityStatus::kMoving;
  return seen;
}

bool RadarChannel::confirmsRest(const Rest& rest, const RadarScan& scan, double scale, Seen& seen) {
  const EgoVelocity alone = measure(seen.pooled, std::nullopt, scale);
  bool confirms = rest.shakes ? alone.status == EgoVelocityStatus::kZeroVelocity : !alone.denies_rest;
  // Few points show early that a platform sets off. Many points show a slow creep.
  for (std::size_t enough = RestPool::kMost / 16; confirms && enough <= RestPool::kMost; enough *= 4) {
    RadarScan filled = memory_.rest_pool.filled(scan, enough);
    confirms = !estimator_.deniesRest(filled);
    if (confirms || !isTightlyCoupled()) continue;
    if (filled.points.size() > scan.points.size()) seen.borrowed_since = memory_.rest_pool.oldest();
    seen.pooled = std::move(filled);
  }
  memory_.rest_pool.add(estimator_.slowPoints(scan));
  return confirms;
}

double RadarChannel::offsetGain(Seen& seen) {
  if (!seen.moves) return 0.0;
  OffsetScan scan = seen.prediction->scan;
  scan.measured = seen.velocity.covariance;
  offset_widths_.add(scan);
  seen.dv_dt_O = offset_widths_.derivative(scan);
  const SmootherOptions& o = options_.smoother;
  const bool moves_enough = seen.dv_dt_O.mean.norm() > o.time_offset_min_acceleration;
  return o.estimate_time_offset && moves_enough ? offset_widths_.gain() : 0.0;
}

EgoVelocity RadarChannel::staticWorld(const RadarScan& scan, const Seen& seen) const {
  EgoVelocity own = withOwnPoints(seen.velocity, scan);
  if (seen.is_own) return estimator_.staticWorld(scan, own, seen.prior);
  own.v_R = seen.prior->v_R;
  return own;
}

EgoVelocity RadarChannel::measure(const RadarScan& scan, const std::optional<VelocityPrior>& prior,
                                  double scale) const {
  return scaled(estimator_.estimate(scan, prior), scale);
}

bool RadarChannel::sharesPoints(const Seen& seen, const std::optional<Time>& before) {
  return seen.has_borrowed && before && *before >= seen.borrowed_since;
}

EgoVelocity RadarChannel::around(const VelocityPrior& prior, const RadarScan& scan,
                                 EgoVelocity result) const {
  result = withOwnPoints(std::move(result), scan);
  if (result.inliers.empty()) result.status = EgoVelocityStatus::kTooFewInliers;
  if (!isValid(result.status)) return result;
  const VelocityCost cost = withSharedError(
      estimator_.likelihood(scan, result.inliers, prior.v_R).at(prior.v_R), result.added_variance);
  Eigen::Matrix3d information = cost.information;
  information.diagonal().array() += 1.0 / (kUnseen * kUnseen);
  result.covariance = information.inverse();
  result.v_R = prior.v_R - result.covariance * cost.gradient;
  return result;
}

Innovation RadarChannel::innovation(Time stamp, const VelocityPrior& prior, const EgoVelocity& measured,
                                    const Seen* seen) const {
  Innovation result;
  result.stamp = stamp;
  result.d = measured.v_R - prior.v_R;
  result.S = prior.covariance + measured.covariance;
  if (seen == nullptr || !seen->prediction) return result;
  result.S_at_offset = seen->prediction->scan.predicted + measured.covariance;
  // A step of the offset looks like model errors and raises their scale. S_at_offset leaves them out, so that
  // the scans after a step keep their weight.
  result.S_at_offset.diagonal() -= measured.added_variance;
  result.J_after = offset_widths_.gain() * seen->dv_dt_O.after;
  result.J_mean = offset_widths_.gain() * seen->dv_dt_O.mean;
  return result;
}

void RadarChannel::judge(const RadarScan& scan, const VelocityPrior& prior, bool had_prior, double scale,
                         RadarAnswer& answer) const {
  const EgoVelocity& measured = answer.ego_velocity;
  // If few points agree, they may be those that fit a wrong prediction. So it is measured again without one.
  const EgoVelocity alone =
      hasMajority(measured) || !had_prior ? measured : measure(scan, std::nullopt, scale);
  if (!hasMajority(alone)) return;
  // A crowd may outnumber the static world. Points that agree with the prediction only then confirm it: noise
  // does not give so many of them.
  const bool is_outvoted =
      countOthers(measured.inliers, alone.inliers) >= options_.radar.ego_velocity.min_inliers;
  if (is_outvoted && !isValid(measured.status)) return;
  if (!is_outvoted) answer.alone = scaled(alone, 1.0 / scale);
  answer.innovation = innovation(scan.stamp, prior, is_outvoted ? measured : alone, nullptr)
                          .widened(options_.gate.model_error);
}

double RadarChannel::offsetSigma(double variance) const {
  const SmootherOptions& o = options_.smoother;
  if (!o.estimate_time_offset) return 0.0;
  const double sigma = offset_uncertainty_.sigma(variance);
  // If the bound is within a sigma, the true offset may lie anywhere beyond it, whatever the curvature.
  return std::abs(offset()) + sigma >= o.max_time_offset ? std::max(sigma, o.max_time_offset) : sigma;
}

std::vector<FixedLagSmoother::RandomWalk> RadarChannel::randomWalks() const {
  const SmootherOptions& o = options_.smoother;
  const std::vector<const Block*> blocks = calibration();
  std::vector<FixedLagSmoother::RandomWalk> walks = {
      {blocks[0], Eigen::VectorXd::Constant(1, std::hypot(o.time_offset_noise, offset_uncertainty_.walk()))}};
  if (blocks.size() == 1) return walks;
  Eigen::Matrix<double, 6, 1> densities;
  densities << Eigen::Vector3d::Constant(o.extrinsics_rotation_noise),
      Eigen::Vector3d::Constant(o.extrinsics_translation_noise);
  walks.push_back({blocks[1], estimatedPart(densities, o.estimate_extrinsics)});
  return walks;
}

}  // namespace rio_t
