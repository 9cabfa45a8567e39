#include "rio_t/radar/ego_velocity.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "consensus.h"
#include "direction_noise.h"
#include "rest_velocity.h"
#include "rio_t/radar/point_filter.h"
#include "velocity_solver.h"

namespace rio_t {
namespace {

constexpr double kTellsSide = 1.0 / 12.0;  // [spans] sigma of a prior that unwraps: a quarter at three sigma
constexpr double kAgrees = 3.0;            // [sigma] of a point

std::vector<RadarDirection> filter(const RadarScan& scan, const EgoVelocityOptions& o) {
  const PointFilter filter(o);
  std::vector<RadarDirection> directions;
  directions.reserve(scan.points.size());
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const RadarPoint& p = scan.points[i];
    if (filter.judge(p) != PointVerdict::kKept) continue;
    directions.push_back({p.position_R / p.position_R.norm(), p.doppler, i});
  }
  return directions;
}

/// Moves each Doppler by whole spans to where a static point is expected at `v_R`.
void unwrap(std::vector<RadarDirection>& points, const Eigen::Vector3d& v_R, double span) {
  for (RadarDirection& p : points) p.doppler = unwrapped(p.doppler, -p.u_R.dot(v_R), span);
}

bool haveSamePoints(const RadarScan& a, const RadarScan& b) {
  const auto same = [](const RadarPoint& p, const RadarPoint& q) {
    return p.position_R == q.position_R && p.doppler == q.doppler && p.snr_db == q.snr_db;
  };
  return std::equal(a.points.begin(), a.points.end(), b.points.begin(), b.points.end(), same);
}

std::vector<std::size_t> indicesOf(const std::vector<RadarDirection>& points) {
  std::vector<std::size_t> indices;
  indices.reserve(points.size());
  for (const RadarDirection& p : points) indices.push_back(p.index);
  return indices;
}

/// Solves for the velocity of `inliers`, then once more for that of the points that agree with the solution.
/// These become the inliers.
VelocitySolution solveMotion(const std::vector<RadarDirection>& points, const PointVariances& noise,
                             const EgoVelocityOptions& o, std::vector<RadarDirection>& inliers) {
  VelocitySolution first = solveLeastSquares(inliers, o);
  if (!first.solved) return first;
  inliers = selectInliers(points, first.v_R, noise, o);
  return o.solver == EgoVelocitySolver::kLeastSquares ? solveLeastSquares(inliers, o)
                                                      : solveLikelihood(inliers, noise, first.v_R, o);
}

/// Completes `result`, which has its points: with the solution and the status `valid`, or with the reason why
/// the solution is refused. `max_sigma` holds for motion only: bins may leave more at rest.
EgoVelocity concluded(EgoVelocity result, const std::vector<RadarDirection>& inliers,
                      const VelocitySolution& solution, EgoVelocityStatus valid,
                      const EgoVelocityOptions& o) {
  result.inliers = indicesOf(inliers);
  const double least = o.min_inlier_fraction * static_cast<double>(result.points.size());
  if (inliers.size() < o.min_inliers || static_cast<double>(inliers.size()) < least) {
    result.status = EgoVelocityStatus::kTooFewInliers;
  } else if (!solution.solved) {
    result.status = EgoVelocityStatus::kIllConditioned;
  } else {
    result.v_R = solution.v_R;
    result.covariance = solution.covariance;
    result.covariance.diagonal() += result.added_variance;
    const bool is_uncertain =
        valid == EgoVelocityStatus::kMoving && largestSigma(result.covariance) > o.max_sigma;
    result.status = is_uncertain ? EgoVelocityStatus::kSigmaTooLarge : valid;
  }
  return result;
}

EgoVelocity concludedAtRest(const EgoVelocity& result, const std::vector<RadarDirection>& inliers,
                            const PointVariances& noise, const EgoVelocityOptions& o) {
  return concluded(result, inliers, solveRest(inliers, noise, o), EgoVelocityStatus::kZeroVelocity, o);
}

EgoVelocity concludedInMotion(EgoVelocity result, const std::vector<RadarDirection>& inliers,
                              const VelocitySolution& solution, const EgoVelocityOptions& o) {
  result.added_variance = o.added_sigma.cwiseAbs2();
  return concluded(std::move(result), inliers, solution, EgoVelocityStatus::kMoving, o);
}

PointVariances startNoise(const EgoVelocityOptions& o) {
  PointVariances noise;
  noise.doppler = square(o.doppler_sigma);
  noise.azimuth = square(o.azimuth_sigma);
  noise.elevation = square(o.elevation_sigma);
  noise.quantization = square(o.doppler_quantization) / 12.0;
  return noise;
}

/// The options with the step in use. Thresholds that are 0 follow from it:
/// - Inlier: rounding moves a Doppler by up to half a step, and 2.5 sigma keep 99 % of the noise.
/// - Zero: within the zero bin. If the noise is larger than that, 1.5 sigma keep 87 % of the points at rest,
///   and zero_velocity_outlier_fraction of them may lie beyond.
/// A sigma of 0 counts as PointNoise::kMinStartDopplerSigma.
EgoVelocityOptions withStep(EgoVelocityOptions o, double step) {
  const double sigma = std::max(o.doppler_sigma, PointNoise::kMinStartDopplerSigma);
  o.doppler_quantization = step;
  if (o.ransac_inlier_threshold == 0.0) o.ransac_inlier_threshold = 0.5 * step + 2.5 * sigma;
  if (o.zero_velocity_threshold == 0.0) o.zero_velocity_threshold = std::max(0.5 * step, 1.5 * sigma);
  return o;
}

}  // namespace

EgoVelocityEstimator::EgoVelocityEstimator(const EgoVelocityOptions& options)
    : given_(options),
      ransac_iterations_(ransacIterations(given_)),
      grid_(given_.doppler_quantization),
      span_(given_.doppler_span),
      options_(withStep(given_, grid_.step().value)),
      noise_(startNoise(options_)) {}

bool EgoVelocityEstimator::observe(const RadarScan& scan) {
  const std::vector<RadarDirection> points = filter(scan, options_);
  const bool has_new_stamp = scan.stamp != observed_.stamp;
  if (has_new_stamp && haveSamePoints(scan, observed_) && !mostReadZero(points, options_)) return false;
  observed_ = scan;
  grid_.add(scan);
  noise_.learnSpread(points);
  const double step = grid_.step().value;
  if (step != options_.doppler_quantization) {
    options_ = withStep(given_, step);
    noise_.setQuantization(square(step) / 12.0);
  }
  if (given_.doppler_span == 0.0 && has_new_stamp) learnSpan(points);
  return true;
}

/// Uses no estimate of the smoother: before the start there is none, and one that took wrapped Dopplers at
/// face value would never show the span.
void EgoVelocityEstimator::learnSpan(const std::vector<RadarDirection>& points) {
  span_.learn(points, std::exchange(before_, std::nullopt), options_.doppler_quantization);
  const bool may_show = span_.value() == 0.0 && span_.reachesBothEnds(points, options_.doppler_quantization);
  if (!may_show || points.size() < 3 || mostReadZero(points, options_)) return;
  const std::optional<Eigen::Vector3d> as_read = ransac(points, options_, ransac_iterations_, 0.0);
  if (!as_read) return;
  const std::optional<Eigen::Vector3d> wrapping =
      ransac(points, options_, ransac_iterations_, span_.possible());
  if (wrapping) before_ = TwoReadings{*as_read, *wrapping};
}

EgoVelocity EgoVelocityEstimator::estimate(const RadarScan& scan,
                                           const std::optional<VelocityPrior>& prior) const {
  const EgoVelocityOptions& o = options_;
  std::vector<RadarDirection> points = filter(scan, o);
  EgoVelocity result;
  result.points = indicesOf(points);
  const auto refused = [&](EgoVelocityStatus why) {
    result.status = why;
    return result;
  };
  if (points.size() < 3) return refused(EgoVelocityStatus::kTooFewPoints);

  // A prior that is off by a quarter of the span does not show on which side a Doppler belongs.
  const double span = span_.value();
  const bool tells_side = prior && largestSigma(prior->covariance) < kTellsSide * span;
  if (tells_side) unwrap(points, prior->v_R, span);

  if (const std::optional<SlowVelocity> slow = findSlowVelocity(points, noise(), o)) {
    result.denies_rest = true;
    return concludedInMotion(result, slow->inliers, slow->solution, o);
  }
  if (mostReadZero(points, o)) return concludedAtRest(result, selectZeros(points, o), noise(), o);

  const std::optional<Eigen::Vector3d> consensus =
      ransac(points, o, ransac_iterations_, tells_side ? 0.0 : span);
  if (!consensus) return refused(EgoVelocityStatus::kIllConditioned);
  if (!tells_side) unwrap(points, *consensus, span);
  std::vector<RadarDirection> inliers = selectInliers(points, *consensus, noise(), o);
  if (prior) inliers = selectInliersWithPrior(points, std::move(inliers), *prior, noise(), o);
  // At rest in front of an object that moves, too few points read zero, but most inliers do.
  if (mostReadZero(inliers, o)) return concludedAtRest(result, selectZeros(inliers, o), noise(), o);

  const VelocitySolution solution = solveMotion(points, noise(), o, inliers);
  return concludedInMotion(result, inliers, solution, o);
}

bool EgoVelocityEstimator::deniesRest(const RadarScan& scan) const {
  const std::vector<RadarDirection> points = filter(scan, options_);
  return directionsAgreeOnMotion(points, options_) && findSlowVelocity(points, noise(), options_);
}

RadarScan EgoVelocityEstimator::slowPoints(const RadarScan& scan) const {
  RadarScan slow = scan;
  slow.points.clear();
  for (const RadarDirection& p : selectSlow(filter(scan, options_), options_))
    slow.points.push_back(scan.points[p.index]);
  return slow;
}

EgoVelocity EgoVelocityEstimator::around(const RadarScan& scan, const VelocityPrior& prior) const {
  EgoVelocity result;
  result.status = EgoVelocityStatus::kTooFewInliers;
  std::vector<RadarDirection> points = filter(scan, options_);
  unwrap(points, prior.v_R, span_.value());
  result.points.reserve(points.size());
  result.inliers.reserve(points.size());
  for (const RadarDirection& p : points) {
    const double variance =
        residualVariance(Angles(p.u_R), prior.v_R, noise()) + p.u_R.dot(prior.covariance * p.u_R);
    result.points.push_back(p.index);
    if (square(p.doppler + p.u_R.dot(prior.v_R)) <= square(kAgrees) * variance)
      result.inliers.push_back(p.index);
  }
  const double share = kMajority * static_cast<double>(result.points.size());
  if (!result.inliers.empty() && static_cast<double>(result.inliers.size()) >= share)
    result.status = EgoVelocityStatus::kMoving;
  result.v_R = prior.v_R;
  result.added_variance = options_.added_sigma.cwiseAbs2();
  return result;
}

EgoVelocity EgoVelocityEstimator::staticWorld(const RadarScan& scan, const EgoVelocity& estimated,
                                              const std::optional<VelocityPrior>& prior) const {
  // With a threshold of a step or more, the inliers of the scan include points that read the next bin.
  const bool reaches_next_bin = options_.ransac_inlier_threshold >= options_.doppler_quantization;
  if (!prior || reaches_next_bin) return estimated;
  const EgoVelocity predicted = around(scan, *prior);
  return isValid(predicted.status) ? predicted : estimated;
}

DopplerLikelihood EgoVelocityEstimator::likelihood(const RadarScan& scan,
                                                   const std::vector<std::size_t>& points,
                                                   const Eigen::Vector3d& v_R) const {
  std::vector<RadarDirection> directions;
  directions.reserve(points.size());
  for (const std::size_t i : points) {
    const RadarPoint& p = scan.points[i];
    directions.push_back({p.position_R.normalized(), p.doppler, i});
  }
  unwrap(directions, v_R, span_.value());
  return DopplerLikelihood(directions, v_R, noise());
}

void EgoVelocityEstimator::learn(const RadarScan& scan, const EgoVelocity& estimated,
                                 const std::optional<VelocityPrior>& prior, const DopplerLikelihood* world) {
  if (estimated.status != EgoVelocityStatus::kMoving) return;
  if (options_.solver != EgoVelocitySolver::kErrorsInVariables) return;
  std::vector<RadarDirection> points = filter(scan, options_);
  std::optional<DopplerLikelihood> found;
  if (world == nullptr) {
    const EgoVelocity velocity = staticWorld(scan, estimated, prior);
    world = &found.emplace(likelihood(scan, velocity.inliers, velocity.v_R));
  }
  unwrap(points, world->about(), span_.value());
  noise_.learn(points, *world, prior);
}

bool hasMajority(const EgoVelocity& velocity) {
  return isValid(velocity.status) && static_cast<double>(velocity.inliers.size()) >=
                                         kMajority * static_cast<double>(velocity.points.size());
}

bool isUnanimous(const EgoVelocity& velocity) {
  return static_cast<double>(velocity.inliers.size()) >
         kUnanimous * static_cast<double>(velocity.points.size());
}

bool isValid(EgoVelocityStatus status) {
  return status == EgoVelocityStatus::kMoving || status == EgoVelocityStatus::kZeroVelocity;
}

std::string toString(EgoVelocityStatus status) {
  constexpr const char* kNames[] = {"moving",          "zero_velocity",   "too_few_points", "too_few_inliers",
                                    "ill_conditioned", "sigma_too_large", "not_estimated"};
  static_assert(std::size(kNames) == static_cast<std::size_t>(EgoVelocityStatus::kNotEstimated) + 1);
  return kNames[static_cast<std::size_t>(status)];
}

}  // namespace rio_t
