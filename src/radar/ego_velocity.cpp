#include "rio_t/radar/ego_velocity.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <stdexcept>
#include <utility>

#include "direction_noise.h"
#include "velocity_solver.h"

namespace rio_t {
namespace {

constexpr double kMajority = 0.6;    // of the points
constexpr double kUnanimous = 0.85;  // of the points
/// A prior with a sigma below this outweighs a majority of the points [m/s]. A moving object and the world
/// differ by more.
constexpr double kMaxSharpSigma = 0.1;
/// Log-likelihood ratio of a point that a velocity explains to one that it does not: a Gaussian of 0.05 m/s
/// against a uniform density over some m/s.
constexpr double kEvidenceOfAPoint = 4.0;
constexpr double kTellsSide = 1.0 / 12.0;  // [spans] a quarter at three sigma
constexpr int kSides[] = {0, -1, 1};       // [spans] that a Doppler may have come back from
constexpr double kAgrees = 3.0;            // [sigma] of a point
/// Twice the log-likelihood ratio of a slow motion to rest: once in 1000 scans at rest (chi-squared, 3
/// degrees of freedom).
constexpr double kDeniesRest = 16.3;
constexpr int kSlowIterations = 10;

void require(bool holds, const char* option, const char* expected) {
  if (!holds) throw std::invalid_argument(std::string("ego velocity: ") + option + " must be " + expected);
}

void validate(const EgoVelocityOptions& o) {
  // Written so that NaN fails.
  require(o.min_range >= 0.0, "min_range", "at least 0 m");
  require(o.max_range > o.min_range, "max_range", "above min_range");
  require(std::isfinite(o.min_snr_db), "min_snr_db", "finite");
  require(o.max_azimuth > 0.0, "max_azimuth", "above 0 rad");
  require(o.max_elevation > 0.0, "max_elevation", "above 0 rad");
  require(o.zero_velocity_threshold >= 0.0, "zero_velocity_threshold", "at least 0 m/s");
  require(o.zero_velocity_outlier_fraction >= 0.0 && o.zero_velocity_outlier_fraction < 1.0,
          "zero_velocity_outlier_fraction", "in [0, 1)");
  require(o.zero_velocity_sigma > 0.0, "zero_velocity_sigma", "above 0 m/s");
  require(o.ransac_inlier_threshold >= 0.0, "ransac_inlier_threshold", "at least 0 m/s");
  require(o.ransac_outlier_probability >= 0.0 && o.ransac_outlier_probability < 1.0,
          "ransac_outlier_probability", "in [0, 1)");
  require(o.ransac_success_probability > 0.0 && o.ransac_success_probability < 1.0,
          "ransac_success_probability", "in (0, 1)");
  require(o.prior_gate > 0.0, "prior_gate", "above 0");
  require(o.min_inlier_fraction >= 0.0 && o.min_inlier_fraction <= 1.0, "min_inlier_fraction", "in [0, 1]");
  require(o.azimuth_sigma >= 0.0 && o.azimuth_sigma < 0.5, "azimuth_sigma", "in [0, 0.5) rad");
  require(o.elevation_sigma >= 0.0 && o.elevation_sigma < 0.5, "elevation_sigma", "in [0, 0.5) rad");
  require(o.doppler_sigma >= 0.0, "doppler_sigma", "at least 0 m/s");
  require(o.doppler_quantization >= 0.0 && std::isfinite(o.doppler_quantization), "doppler_quantization",
          "finite and at least 0 m/s");
  require(o.doppler_span >= 0.0, "doppler_span", "at least 0 m/s");
  require((o.added_sigma.array() >= 0.0).all(), "added_sigma", "at least 0 m/s");
  require(o.max_condition_number > 1.0, "max_condition_number", "above 1");
  require(o.max_sigma > 0.0, "max_sigma", "above 0 m/s");
}

/// Draws needed so that one of them is free of outliers with the wanted probability (Fischler and Bolles,
/// 1981).
int ransacIterations(const EgoVelocityOptions& o) {
  constexpr int kMax = 1000;
  const double clean_draw = std::pow(1.0 - o.ransac_outlier_probability, 3);
  if (clean_draw >= 1.0) return 1;
  const double n = std::ceil(std::log(1.0 - o.ransac_success_probability) / std::log1p(-clean_draw));
  return static_cast<int>(std::clamp(n, 1.0, static_cast<double>(kMax)));
}

std::vector<RadarDirection> filter(const RadarScan& scan, const EgoVelocityOptions& o) {
  std::vector<RadarDirection> directions;
  directions.reserve(scan.points.size());
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const RadarPoint& p = scan.points[i];
    const double range = p.position_R.norm();
    // At range zero there is no direction, whatever min_range says. NaN fails every comparison.
    if (!(range > 0.0 && range >= o.min_range && range <= o.max_range)) continue;
    if (!(p.snr_db >= o.min_snr_db) || !std::isfinite(p.doppler)) continue;
    const Eigen::Vector3d u = p.position_R / range;
    if (std::abs(std::atan2(u.x(), u.y())) > o.max_azimuth) continue;
    if (std::abs(std::asin(std::clamp(u.z(), -1.0, 1.0))) > o.max_elevation) continue;
    directions.push_back({u, p.doppler, i});
  }
  return directions;
}

/// Moves each Doppler by whole spans to where a static point is expected at `v_R`.
void unwrap(std::vector<RadarDirection>& points, const Eigen::Vector3d& v_R, double span) {
  for (RadarDirection& p : points) p.doppler = unwrapped(p.doppler, -p.u_R.dot(v_R), span);
}

/// Draws of indices without std::uniform_int_distribution, whose results differ between standard libraries.
class IndexDraw {
 public:
  explicit IndexDraw(std::uint32_t seed) : engine_(seed) {}
  /// In [0, n), n < 2^32.
  std::size_t below(std::size_t n) {
    return static_cast<std::size_t>((static_cast<std::uint64_t>(engine_()) * n) >> 32U);
  }

 private:
  std::mt19937 engine_;
};

/// Velocity on which three directions agree; none where they lie (nearly) in a plane.
bool solveThree(const RadarDirection& a, const RadarDirection& b, const RadarDirection& c,
                Eigen::Vector3d& v_R) {
  const Eigen::Vector3d bc = b.u_R.cross(c.u_R);
  const double determinant = a.u_R.dot(bc);
  if (std::abs(determinant) < 1e-4) return false;
  v_R = (a.doppler * bc + b.doppler * c.u_R.cross(a.u_R) + c.doppler * a.u_R.cross(b.u_R)) / -determinant;
  return true;
}

/// The velocity that most points agree with, among rest and those of three random points each. Each point
/// costs its squared residual up to the threshold (MSAC), so that among equally many inliers the better fit
/// wins. `points` has at least three. None where no three drawn span 3D.
/// With a span, each Doppler counts modulo the span, and the drawn ones may have come back from either side.
std::optional<Eigen::Vector3d> ransac(const std::vector<RadarDirection>& points, const EgoVelocityOptions& o,
                                      int iterations, double span) {
  const double limit = o.ransac_inlier_threshold * o.ransac_inlier_threshold;
  Eigen::Vector3d best_v_R = Eigen::Vector3d::Zero();
  double best = std::numeric_limits<double>::infinity();
  const auto offer = [&](const Eigen::Vector3d& v_R) {
    double cost = 0.0;
    for (const RadarDirection& p : points) {
      const double r = unwrapped(p.doppler + p.u_R.dot(v_R), 0.0, span);
      cost += std::min(r * r, limit);
      if (cost >= best) return;
    }
    best = cost;
    best_v_R = v_R;
  };
  offer(Eigen::Vector3d::Zero());

  bool spans_space = false;
  const std::size_t n = points.size();
  IndexDraw draw(o.ransac_seed);
  for (int iteration = 0; iteration < iterations; ++iteration) {
    const std::size_t i = draw.below(n);
    std::size_t j = draw.below(n - 1);
    if (j >= i) ++j;
    std::size_t k = draw.below(n - 2);
    if (k >= std::min(i, j)) ++k;
    if (k >= std::max(i, j)) ++k;
    const int sides = span > 0.0 ? 27 : 1;
    for (int side = 0; side < sides; ++side) {
      RadarDirection a = points[i], b = points[j], c = points[k];
      a.doppler += span * kSides[side % 3];
      b.doppler += span * kSides[side / 3 % 3];
      c.doppler += span * kSides[side / 9];
      Eigen::Vector3d v_R;
      if (!solveThree(a, b, c, v_R)) break;
      spans_space = true;
      offer(v_R);
    }
  }
  return spans_space ? std::make_optional(best_v_R) : std::nullopt;
}

/// Points that agree with `v_R`: within the threshold, or within three sigma where the noise of the direction
/// alone is larger than the threshold, as it is at speed.
std::vector<RadarDirection> selectInliers(const std::vector<RadarDirection>& points,
                                          const Eigen::Vector3d& v_R, const EgoVelocityOptions& o,
                                          const PointVariances& noise) {
  const bool knows_noise = o.solver == EgoVelocitySolver::kErrorsInVariables;
  const double limit = o.ransac_inlier_threshold * o.ransac_inlier_threshold;
  std::vector<RadarDirection> inliers;
  inliers.reserve(points.size());
  for (const RadarDirection& p : points) {
    const double r = p.doppler + p.u_R.dot(v_R);
    if (r * r <= limit || (knows_noise && r * r <= 9.0 * residualVariance(Angles(p.u_R), v_R, noise)))
      inliers.push_back(p);
  }
  return inliers;
}

double largestSigma(const Eigen::Matrix3d& covariance) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(eigen.eigenvalues()[2]);
}

/// Squared sigmas between a velocity and the prior.
double squaredDistance(const VelocitySolution& solution, const VelocityPrior& prior) {
  const Eigen::Matrix3d covariance = prior.covariance + solution.covariance;
  const Eigen::Vector3d d = solution.v_R - prior.v_R;
  return d.dot(covariance.inverse() * d);
}

/// Replaces `inliers` by the points that support a velocity near the prior, if that is the better choice. A
/// sharp prior that contradicts the velocity of `inliers` outweighs even a majority of the points. A vague
/// prior is weighed against their number: if it is wrong, it must not find a minority that sides with it.
/// False if the scan is ambiguous: a vague prior contradicts neither of two velocities, and the number of
/// points does not decide.
bool selectInliersWithPrior(const std::vector<RadarDirection>& points, const VelocityPrior& prior,
                            const EgoVelocityOptions& o, const PointVariances& noise,
                            std::vector<RadarDirection>& inliers) {
  const double gate = o.prior_gate * o.prior_gate;
  const auto n = static_cast<double>(points.size());
  const bool is_sharp = largestSigma(prior.covariance) < kMaxSharpSigma;
  const VelocitySolution unaided = solveLeastSquares(inliers, o);
  const double d2_unaided =
      unaided.solved ? squaredDistance(unaided, prior) : std::numeric_limits<double>::max();
  if (is_sharp && d2_unaided <= gate) return true;
  std::vector<RadarDirection> supporters = selectInliers(points, prior.v_R, o, noise);
  VelocitySolution aided = solveLeastSquares(supporters, o);
  if (!aided.solved) return true;
  supporters = selectInliers(points, aided.v_R, o, noise);
  aided = solveLeastSquares(supporters, o);
  if (!aided.solved || static_cast<double>(supporters.size()) < o.prior_min_inlier_fraction * n) return true;
  const double d2_aided = squaredDistance(aided, prior);
  const double fewer = static_cast<double>(inliers.size()) - static_cast<double>(supporters.size());
  if (is_sharp ? d2_aided <= gate : kEvidenceOfAPoint * fewer < 0.5 * (d2_unaided - d2_aided)) {
    inliers = std::move(supporters);
    return true;
  }
  if (is_sharp || d2_unaided > gate || d2_aided > gate) return true;
  const bool is_unanimous = static_cast<double>(inliers.size()) > kUnanimous * n;
  return is_unanimous || squaredDistance(unaided, {aided.v_R, aided.covariance}) <= gate;
}

/// Covariance at rest, where every inlier reads the zero bin, of width q. Two things bound the velocity:
/// - a point reads zero only while |u . v| < q/2, and so v lies in the ellipsoid v' M v < q^2/4, M = mean of
/// u u';
///   a uniform density over an ellipsoid in 3D has the covariance M^-1 (q^2/4) / 5. More points do not help.
/// - noise of sigma s carries readings over the edge of the bin, the sooner the faster the platform creeps:
/// the
///   likelihood P(v) that a point reads zero has the curvature -(log P)'' = 2 z phi(z) / (s^2 P(0)) at rest,
///   z = q / (2 s), for each of the n points (1/s^2 as q goes to 0, nothing where q is much above s).
/// False: the directions leave some velocity unseen.
bool restCovariance(const std::vector<RadarDirection>& inliers, const EgoVelocityOptions& o,
                    const PointVariances& noise, Eigen::Matrix3d& covariance) {
  Eigen::Matrix3d mean = Eigen::Matrix3d::Zero();
  for (const RadarDirection& p : inliers) mean += p.u_R * p.u_R.transpose();
  mean /= static_cast<double>(inliers.size());
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(mean);
  if (!(eigen.eigenvalues()[0] * o.max_condition_number > eigen.eigenvalues()[2])) return false;
  const double q = o.doppler_quantization;
  const double s = std::sqrt(noise.doppler);
  const auto n = static_cast<double>(inliers.size());
  const double z = s > 0.0 ? q / (2.0 * s) : 0.0;
  double scale = s * s / n;  // of M^-1; this is without a bin
  if (q > 0.0) {
    const double phi = std::exp(-0.5 * z * z) / std::sqrt(2.0 * M_PI);
    const double curvature = s > 0.0 ? 2.0 * z * phi / (s * s * std::erf(z / std::sqrt(2.0))) : 0.0;
    scale = 1.0 / (20.0 / (q * q) + n * curvature);
  }
  covariance = o.zero_velocity_sigma * o.zero_velocity_sigma * Eigen::Matrix3d::Identity() +
               scale * eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() *
                   eigen.eigenvectors().transpose();
  return true;
}

/// Minus the log-likelihood of rest where some of the points read the bin beside zero for reasons of their
/// own, on either side. As DopplerLikelihood says it, so many points cannot be wrong by chance.
double restWithPointsBeside(const std::vector<RadarDirection>& points, const EgoVelocityOptions& o) {
  const auto n = static_cast<double>(points.size());
  const auto beside =
      static_cast<double>(std::count_if(points.begin(), points.end(), [&](const RadarDirection& p) {
        return std::abs(p.doppler) > o.zero_velocity_threshold;
      }));
  const auto logOf = [](double count, double share) { return count > 0.0 ? count * std::log(share) : 0.0; };
  return -logOf(n - beside, (n - beside) / n) - logOf(beside, 0.5 * beside / n);
}

/// A slow motion that hides in the bins around zero: most points read zero, but those along the motion do
/// not. None if rest explains the points about as well. `points` read at most one bin.
std::optional<VelocitySolution> slowMotion(const std::vector<RadarDirection>& points,
                                           const PointVariances& noise, const EgoVelocityOptions& o) {
  if (points.size() < o.min_inliers) return std::nullopt;
  VelocitySolution solution = solveLeastSquares(points, o);
  if (!solution.solved || solution.v_R.isZero()) return std::nullopt;
  const DopplerLikelihood likelihood(points, Eigen::Vector3d::Zero(), noise);
  double at_rest = likelihood.at(Eigen::Vector3d::Zero()).value;
  if (o.doppler_quantization > 0.0) at_rest = std::min(at_rest, restWithPointsBeside(points, o));
  if (at_rest < 0.5 * kDeniesRest) return std::nullopt;
  VelocityCost cost = likelihood.at(solution.v_R);
  double damping = 1.0 / square(o.doppler_quantization + o.zero_velocity_threshold);
  for (int i = 0; i < kSlowIterations; ++i) {
    Eigen::Matrix3d damped = cost.information;
    damped.diagonal().array() += damping;
    const Eigen::Vector3d v_R = solution.v_R - damped.inverse() * cost.gradient;
    const VelocityCost next = likelihood.at(v_R);
    damping *= next.value < cost.value ? 0.1 : 10.0;
    if (next.value >= cost.value) continue;
    solution.v_R = v_R;
    cost = next;
  }
  if (2.0 * (at_rest - cost.value) < kDeniesRest) return std::nullopt;
  solution.solved = cost.information.determinant() > 0.0;
  solution.covariance = cost.information.inverse();
  return solution;
}

PointVariances startNoise(const EgoVelocityOptions& o) {
  return {square(o.doppler_sigma), square(o.azimuth_sigma), square(o.elevation_sigma),
          square(o.doppler_quantization) / 12.0};
}

/// The options with the step that holds, and with the thresholds that were left to it.
/// - Inlier: the step rounds by up to half of itself; 2.5 sigma keep 99 % of the noise besides.
/// - Zero: within the zero bin; where the noise is larger than that, 1.5 sigma keep 87 % of the points at
/// rest,
///   and zero_velocity_outlier_fraction of them may lie beyond.
/// A sigma of 0 to start with does not mean that nothing else is possible.
EgoVelocityOptions withStep(EgoVelocityOptions o, double step) {
  const double sigma = std::max(o.doppler_sigma, PointNoise::kMinStartDopplerSigma);
  o.doppler_quantization = step;
  if (o.ransac_inlier_threshold == 0.0) o.ransac_inlier_threshold = 0.5 * step + 2.5 * sigma;
  if (o.zero_velocity_threshold == 0.0) o.zero_velocity_threshold = std::max(0.5 * step, 1.5 * sigma);
  return o;
}

EgoVelocityOptions validated(const EgoVelocityOptions& o) {
  validate(o);
  return o;
}

}  // namespace

EgoVelocityEstimator::EgoVelocityEstimator(const EgoVelocityOptions& options)
    : given_(validated(options)),
      ransac_iterations_(ransacIterations(given_)),
      grid_(given_.doppler_quantization),
      span_(given_.doppler_span),
      options_(withStep(given_, grid_.step().value)),
      noise_(startNoise(options_)) {}

void EgoVelocityEstimator::observe(const RadarScan& scan) {
  grid_.add(scan);
  const double step = grid_.step().value;
  if (step == options_.doppler_quantization) return;
  options_ = withStep(given_, step);
  noise_.setQuantization(square(step) / 12.0);
}

EgoVelocity EgoVelocityEstimator::estimate(const RadarScan& scan,
                                           const std::optional<VelocityPrior>& prior) const {
  const EgoVelocityOptions& o = options_;
  std::vector<RadarDirection> points = filter(scan, o);
  const double span = span_.value();
  // A prior that is off by a quarter of the span does not tell on which side a Doppler belongs.
  const bool tells_side = prior && largestSigma(prior->covariance) < kTellsSide * span;
  if (tells_side) unwrap(points, prior->v_R, span);
  std::vector<RadarDirection> inliers;
  EgoVelocity result;
  for (const RadarDirection& p : points) result.points.push_back(p.index);
  const auto n = static_cast<double>(points.size());
  if (points.size() < 3) {
    result.status = EgoVelocityStatus::kTooFewPoints;
    return result;
  }

  const auto reads_zero = [&](const RadarDirection& p) {
    return std::abs(p.doppler) <= o.zero_velocity_threshold;
  };
  const auto most_read_zero = [&](const std::vector<RadarDirection>& some) {
    const auto zeros = static_cast<double>(std::count_if(some.begin(), some.end(), reads_zero));
    return zeros >= (1.0 - o.zero_velocity_outlier_fraction) * static_cast<double>(some.size());
  };

  std::vector<RadarDirection> slow;
  std::copy_if(points.begin(), points.end(), std::back_inserter(slow), [&](const RadarDirection& p) {
    return std::abs(p.doppler) <= o.zero_velocity_threshold + o.doppler_quantization;
  });
  const auto n_slow = static_cast<double>(slow.size());
  std::optional<VelocitySolution> creeping;
  if (n_slow >= kMajority * n) creeping = slowMotion(slow, noise(), o);
  result.denies_rest = creeping.has_value();

  bool rest = !creeping && most_read_zero(points);
  if (creeping) {
    inliers = selectInliers(points, creeping->v_R, o, noise());
    if (const auto refined = slowMotion(inliers, noise(), o)) creeping = refined;
  } else if (rest) {
    inliers = points;
  } else {
    const std::optional<Eigen::Vector3d> consensus =
        ransac(points, o, ransac_iterations_, tells_side ? 0.0 : span);
    if (!consensus) {
      result.status = EgoVelocityStatus::kIllConditioned;
      return result;
    }
    if (!tells_side) unwrap(points, *consensus, span);
    inliers = selectInliers(points, *consensus, o, noise());
    if (prior && !selectInliersWithPrior(points, *prior, o, noise(), inliers)) {
      result.status = EgoVelocityStatus::kAmbiguous;
      return result;
    }
    // At rest in front of an object that moves, too many points disagree for the test above, but not these.
    rest = most_read_zero(inliers);
  }
  if (rest) {
    inliers.erase(std::remove_if(inliers.begin(), inliers.end(), std::not_fn(reads_zero)), inliers.end());
  }

  VelocitySolution solution;
  if (creeping) {
    solution = *creeping;
    result.told_variance = o.added_sigma.cwiseAbs2();
    solution.covariance.diagonal() += result.told_variance;
  } else if (rest) {
    solution.solved = restCovariance(inliers, o, noise(), solution.covariance);
  } else {
    solution = solveLeastSquares(inliers, o);
    if (solution.solved) {
      inliers = selectInliers(points, solution.v_R, o, noise());
      solution = o.solver == EgoVelocitySolver::kLeastSquares
                     ? solveLeastSquares(inliers, o)
                     : solveErrorsInVariables(inliers, solution.v_R, noise(), o);
    }
    result.told_variance = o.added_sigma.cwiseAbs2();
    solution.covariance.diagonal() += result.told_variance;
  }

  for (const RadarDirection& p : inliers) result.inliers.push_back(p.index);
  if (inliers.size() < o.min_inliers || static_cast<double>(inliers.size()) < o.min_inlier_fraction * n) {
    result.status = EgoVelocityStatus::kTooFewInliers;
  } else if (!solution.solved) {
    result.status = EgoVelocityStatus::kIllConditioned;
  } else {
    result.v_R = solution.v_R;
    result.covariance = solution.covariance;
    result.status = largestSigma(result.covariance) > o.max_sigma ? EgoVelocityStatus::kSigmaTooLarge
                    : rest                                        ? EgoVelocityStatus::kZeroVelocity
                                                                  : EgoVelocityStatus::kMoving;
  }
  return result;
}

EgoVelocity EgoVelocityEstimator::around(const RadarScan& scan, const VelocityPrior& prior) const {
  EgoVelocity result;
  result.status = EgoVelocityStatus::kTooFewInliers;
  std::vector<RadarDirection> points = filter(scan, options_);
  unwrap(points, prior.v_R, span_.value());
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
  result.told_variance = options_.added_sigma.cwiseAbs2();
  return result;
}

DopplerLikelihood EgoVelocityEstimator::likelihood(const RadarScan& scan,
                                                   const std::vector<std::size_t>& points,
                                                   const Eigen::Vector3d& v_R) const {
  std::vector<RadarDirection> directions;
  for (const std::size_t i : points) {
    const RadarPoint& p = scan.points[i];
    directions.push_back({p.position_R.normalized(), p.doppler, i});
  }
  unwrap(directions, v_R, span_.value());
  return DopplerLikelihood(directions, v_R, noise());
}

void EgoVelocityEstimator::learn(const RadarScan& scan, const EgoVelocity& estimated) {
  if (estimated.status != EgoVelocityStatus::kMoving) return;
  std::vector<RadarDirection> points = filter(scan, options_);
  span_.learn(points, estimated.v_R, options_.doppler_quantization);
  if (options_.solver != EgoVelocitySolver::kErrorsInVariables) return;
  unwrap(points, estimated.v_R, span_.value());
  noise_.learn(points, estimated.inliers, estimated.v_R);
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
  switch (status) {
    case EgoVelocityStatus::kMoving:
      return "moving";
    case EgoVelocityStatus::kZeroVelocity:
      return "zero_velocity";
    case EgoVelocityStatus::kTooFewPoints:
      return "too_few_points";
    case EgoVelocityStatus::kTooFewInliers:
      return "too_few_inliers";
    case EgoVelocityStatus::kIllConditioned:
      return "ill_conditioned";
    case EgoVelocityStatus::kSigmaTooLarge:
      return "sigma_too_large";
    case EgoVelocityStatus::kAmbiguous:
      return "ambiguous";
  }
  throw std::invalid_argument("ego velocity: not a status");
}

std::string toString(EgoVelocitySolver solver) {
  switch (solver) {
    case EgoVelocitySolver::kLeastSquares:
      return "ls";
    case EgoVelocitySolver::kErrorsInVariables:
      return "eiv";
  }
  throw std::invalid_argument("ego velocity: not a solver");
}

EgoVelocitySolver egoVelocitySolverFromString(const std::string& name) {
  if (name == "ls") return EgoVelocitySolver::kLeastSquares;
  if (name == "eiv") return EgoVelocitySolver::kErrorsInVariables;
  throw std::invalid_argument("ego velocity: solver must be ls or eiv, not '" + name + "'");
}

}  // namespace rio_t
