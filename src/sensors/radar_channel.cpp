#include "rio_t/sensors/radar_channel.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <iterator>

namespace rio_t {
namespace {

/// Where roll and pitch are known no better [rad], the prediction is not linear in them, and its covariance
/// too small to reject anything by.
constexpr double kMaxTiltSigma = 0.1;
/// [m/s] Sigma of a velocity that no point of a scan sees.
constexpr double kUnseen = 100.0;

/// How many of `some` are not in `others`; both ascend.
std::size_t countOthers(const std::vector<std::size_t>& some, const std::vector<std::size_t>& others) {
  return static_cast<std::size_t>(std::count_if(some.begin(), some.end(), [&](std::size_t index) {
    return !std::binary_search(others.begin(), others.end(), index);
  }));
}

std::vector<std::size_t> below(std::size_t limit, const std::vector<std::size_t>& ascending) {
  return {ascending.begin(), std::lower_bound(ascending.begin(), ascending.end(), limit)};
}

/// Those of `own` that agree with a prediction, if the majority of the points does.
std::vector<std::size_t> alsoIn(const EgoVelocity& predicted, const std::vector<std::size_t>& own) {
  std::vector<std::size_t> both;
  if (isValid(predicted.status))
    std::set_intersection(own.begin(), own.end(), predicted.inliers.begin(), predicted.inliers.end(),
                          std::back_inserter(both));
  return both.empty() ? own : both;
}

VelocityPrior zeroVelocity(double sigma) {
  return {Eigen::Vector3d::Zero(), sigma * sigma * Eigen::Matrix3d::Identity()};
}

}  // namespace

RadarChannel::RadarChannel(const RadarChannelOptions& options, const Eigen::Vector3d& g_W,
                           const ImuBuffer& imu)
    : options_(options),
      estimator_(options.ego_velocity),
      in_window_(options.smoother, options.T_IR, g_W, imu),
      feasibility_(options.feasibility),
      step_detector_(options.offset_step_detector),
      offset_uncertainty_(options.smoother.huber_threshold),
      gate_(options.smoother) {}

void RadarChannel::start(FixedLagSmoother& smoother, Time time, const NodePrior& prior) {
  rio_t::start(smoother, in_window_, time, prior);
  step_detector_ = OffsetStepDetector(options_.offset_step_detector);
  offset_uncertainty_ = OffsetUncertainty(options_.smoother.huber_threshold);
  offset_evidence_ = OffsetEvidence();
  feasibility_ = FeasibilityCheck(options_.feasibility);
  pool_.clear();
  gate_.used(time);
}

RadarAnswer RadarChannel::use(const RadarScan& scan, const ScanContext& context, FixedLagSmoother& smoother) {
  RadarAnswer answer;
  const auto reject = [&](const std::string& reason) {
    answer.rejected_because = reason;
    return answer;
  };
  const std::optional<RadarVelocityPrediction> prediction = in_window_.predict(smoother, scan.stamp);
  std::optional<VelocityPrior> prior;
  if (prediction) prior = prediction->velocity;
  const bool tightly = options_.smoother.radar_factor == RadarFactor::kDoppler;
  const auto velocityAt = [&](Time stamp) { return in_window_.velocityAt(smoother, stamp); };
  const RadarScan pooled = tightly ? pool_.filled(scan, velocityAt) : scan;
  const bool has_borrowed = pooled.points.size() > scan.points.size();
  if (context.at_rest) {
    answer.ego_velocity = measure(pooled, std::nullopt, context.model_error_scale);
    answer.at_rest = !answer.ego_velocity.denies_rest;
  }
  if (answer.at_rest) prior = zeroVelocity(options_.rest_velocity_sigma);

  std::optional<VelocityPrior> expected = prior;
  // Few and coarse points agree with many velocities: they must not all side with a prediction that is a
  // little wrong.
  const double doubt = options_.smoother.innovation_model_error;
  if (expected && has_borrowed) expected->covariance.diagonal().array() += doubt * doubt;
  answer.ego_velocity =
      measure(pooled, context.has_diverged ? std::nullopt : expected, context.model_error_scale);
  answer.was_predicted = prior.has_value();
  if (prior) judge(pooled, *prior, context.model_error_scale, answer);
  EgoVelocity measured = answer.ego_velocity;
  const bool has_own = isValid(measured.status);
  if (!has_own && tightly && prior && !context.has_diverged)
    measured = around(*prior, scan, estimator_.around(pooled, *prior), context.model_error_scale);
  if (!isValid(measured.status)) return reject(toString(answer.ego_velocity.status));
  if (has_own && !feasibility_.accept(scan.stamp, measured.v_R)) return reject("infeasible_velocity");

  const bool tilt_is_known = !prediction || prediction->tilt_sigma < kMaxTiltSigma;
  const bool moving = prediction && !answer.at_rest && measured.status == EgoVelocityStatus::kMoving;
  bool informs_offset = false;
  if (moving) {
    offset_evidence_.add(scan.stamp, prediction->dv_dt_O, measured.covariance.inverse());
    informs_offset = offset_evidence_.gain() > 0.0 &&
                     prediction->dv_dt_O.mean.norm() > options_.smoother.time_offset_min_acceleration;
  }
  answer.offset_gain = informs_offset ? offset_evidence_.gain() : 0.0;
  // An offset that is wrong by c shows as (J + noise) c; nothing else tells of the noise's part.
  if (informs_offset) measured.covariance.diagonal().array() += prediction->rate_variance;

  RadarScanTime taken{scan.stamp, options_.T_IR, answer.offset_gain};
  taken.linear_from_t_O = offset();
  if (tightly && measured.status == EgoVelocityStatus::kMoving) {
    std::vector<std::size_t> own = below(scan.points.size(), measured.inliers);
    // A thing that moves slowly passes for static in a velocity, but not point by point.
    if (prior && has_own) own = alsoIn(estimator_.around(scan, *prior), own);
    if (own.empty()) return reject("too_few_inliers");
    const auto points = std::make_shared<DopplerLikelihood>(estimator_.likelihood(scan, own, measured.v_R));
    answer.doppler =
        DopplerMeasurement{taken, points, measured.told_variance, options_.smoother.huber_threshold};
    if (informs_offset) answer.doppler->shared_variances.array() += prediction->rate_variance;
  }

  // A minority that sides with the prediction has more noise than its covariance says.
  const bool can_be_judged = moving && tilt_is_known && hasMajority(measured);
  std::optional<Innovation> all, now;
  if (prior) {
    all = innovation(scan.stamp, *prior, measured, prediction);
    // Borrowed points made up innovations before.
    now = has_borrowed && moving
              ? innovation(scan.stamp, *prior, around(*prior, scan, measured, 1.0), prediction)
              : all;
  }
  if (can_be_judged && informs_offset && options_.smoother.estimate_time_offset &&
      step_detector_.stepped(*now)) {
    in_window_.stepOffset(smoother, scan.stamp);
    offset_uncertainty_.offsetStepped();
    answer.offset_stepped = true;
  }
  if (all && gate_.rejects(*all, isUnanimous(measured), tilt_is_known)) return reject("innovation");
  const RadarInWindow::AddResult added =
      answer.doppler
          ? in_window_.add(smoother, *answer.doppler)
          : in_window_.add(smoother, RadarVelocityMeasurement{taken, measured.v_R, measured.covariance});
  if (added != RadarInWindow::AddResult::kAdded) return reject(toString(added));
  if (can_be_judged && informs_offset) offset_uncertainty_.add(*now);
  // A borrowed point must not teach twice.
  const bool is_new = !has_borrowed || scan.stamp - learned_at_ > ScanPool::kMaxAge;
  if (can_be_judged && has_own && is_new) {
    answer.used = all;
    answer.prediction_covariance = prior->covariance;
  }
  gate_.used(scan.stamp);
  if (!answer.at_rest && has_own && is_new) {
    estimator_.learn(pooled, measured);
    learned_at_ = scan.stamp;
  }
  return answer;
}

EgoVelocity RadarChannel::measure(const RadarScan& scan, const std::optional<VelocityPrior>& prior,
                                  double scale) const {
  EgoVelocity measured = estimator_.estimate(scan, prior);
  measured.covariance.diagonal() += (scale - 1.0) * measured.told_variance;
  measured.told_variance *= scale;
  return measured;
}

EgoVelocity RadarChannel::around(const VelocityPrior& prior, const RadarScan& scan, EgoVelocity result,
                                 double scale) const {
  result.inliers = below(scan.points.size(), result.inliers);
  if (result.inliers.empty()) result.status = EgoVelocityStatus::kTooFewInliers;
  if (!isValid(result.status)) return result;
  result.told_variance *= scale;
  const VelocityCost cost = withSharedError(
      estimator_.likelihood(scan, result.inliers, prior.v_R).at(prior.v_R), result.told_variance);
  Eigen::Matrix3d information = cost.information;
  information.diagonal().array() += 1.0 / (kUnseen * kUnseen);
  result.covariance = information.inverse();
  result.v_R = prior.v_R - result.covariance * cost.gradient;
  return result;
}

Innovation RadarChannel::innovation(Time stamp, const VelocityPrior& prior, const EgoVelocity& measured,
                                    const std::optional<RadarVelocityPrediction>& prediction) const {
  Innovation result;
  result.stamp = stamp;
  result.d = measured.v_R - prior.v_R;
  result.S = prior.covariance + measured.covariance;
  if (!prediction) return result;
  result.S_at_offset = prediction->covariance_at_offset + measured.covariance;
  result.J_O = offset_evidence_.gain() * prediction->dv_dt_O.forInnovation();
  return result;
}

void RadarChannel::judge(const RadarScan& scan, const VelocityPrior& prior, double scale,
                         RadarAnswer& answer) const {
  const EgoVelocity& measured = answer.ego_velocity;
  // Where few points agree, they may be those that side with a wrong prediction. The scan is asked again
  // without it.
  const EgoVelocity alone = hasMajority(measured) ? measured : measure(scan, std::nullopt, scale);
  if (!hasMajority(alone)) return;
  // A crowd may outnumber the static world. What then sides with the prediction alone is its witness: noise
  // does not give so many of them.
  const bool is_outvoted = countOthers(measured.inliers, alone.inliers) >= options_.ego_velocity.min_inliers;
  if (is_outvoted && !isValid(measured.status)) return;
  if (!is_outvoted) answer.alone = alone;
  answer.judged = innovation(scan.stamp, prior, is_outvoted ? measured : alone, std::nullopt)
                      .widened(options_.smoother.innovation_model_error);
}

double RadarChannel::offsetSigma(double variance) const {
  return options_.smoother.estimate_time_offset ? offset_uncertainty_.sigma(variance) : 0.0;
}

FixedLagSmoother::RandomWalk RadarChannel::offsetWalk() const {
  return {&offsetBlock(), std::hypot(options_.smoother.time_offset_noise, offset_uncertainty_.walk())};
}

}  // namespace rio_t
