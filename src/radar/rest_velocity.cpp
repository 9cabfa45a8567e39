#include "rest_velocity.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "consensus.h"
#include "direction_noise.h"
#include "velocity_solver.h"

namespace rio_t {
namespace {

/// Twice the log-likelihood ratio of a slow motion to rest. At rest, one scan in 1000 exceeds it
/// (chi-squared, 3 degrees of freedom).
constexpr double kDeniesRest = 16.3;
/// [rad] 15 degrees, the beam of a radar with few antennas: the echoes of one object lie within it.
constexpr double kCellWidth = 0.26;

bool readsZero(const RadarDirection& p, const EgoVelocityOptions& o) {
  return std::abs(p.doppler) <= o.zero_velocity_threshold;
}

/// The points whose Doppler is at most `limit` [m/s], to either side.
std::vector<RadarDirection> slowerThan(double limit, const std::vector<RadarDirection>& points) {
  std::vector<RadarDirection> slow;
  std::copy_if(points.begin(), points.end(), std::back_inserter(slow),
               [limit](const RadarDirection& p) { return std::abs(p.doppler) <= limit; });
  return slow;
}

/// Minus the log-likelihood of a rest at which a share of the points reads the bin beside zero, on either
/// side, as echoes do that move by themselves. In DopplerLikelihood, points err independently, so many of
/// them would never read that bin by chance.
double restWithPointsBeside(const std::vector<RadarDirection>& points, const EgoVelocityOptions& o) {
  const auto n = static_cast<double>(points.size());
  const auto beside = static_cast<double>(
      std::count_if(points.begin(), points.end(), [&](const RadarDirection& p) { return !readsZero(p, o); }));
  const auto logOf = [](double count, double share) { return count > 0.0 ? count * std::log(share) : 0.0; };
  return -logOf(n - beside, (n - beside) / n) - logOf(beside, 0.5 * beside / n);
}

/// The likeliest velocity of `points`, which read at most one bin. None if rest is about as likely.
std::optional<VelocitySolution> fitSlowVelocity(const std::vector<RadarDirection>& points,
                                                const PointVariances& noise, const EgoVelocityOptions& o) {
  if (points.size() < o.min_inliers) return std::nullopt;
  const bool has_bins = o.doppler_quantization > 0.0;
  const double beside = has_bins ? restWithPointsBeside(points, o) : std::numeric_limits<double>::infinity();
  if (beside < 0.5 * kDeniesRest) return std::nullopt;
  const VelocitySolution start = solveLeastSquares(points, o);
  if (!start.solved || start.v_R.isZero()) return std::nullopt;
  const DopplerLikelihood likelihood(points, Eigen::Vector3d::Zero(), noise);
  const double at_rest = std::min(likelihood.at(Eigen::Vector3d::Zero()).value, beside);
  if (at_rest < 0.5 * kDeniesRest) return std::nullopt;
  const LikeliestVelocity likeliest = findLikeliest(likelihood, std::nullopt, start.v_R);
  if (2.0 * (at_rest - likeliest.cost) < kDeniesRest) return std::nullopt;
  return solutionOf(likeliest.v_R, likeliest.information, o);
}

}  // namespace

std::vector<RadarDirection> selectZeros(const std::vector<RadarDirection>& points,
                                        const EgoVelocityOptions& o) {
  return slowerThan(o.zero_velocity_threshold, points);
}

std::vector<RadarDirection> selectSlow(const std::vector<RadarDirection>& points,
                                       const EgoVelocityOptions& o) {
  return slowerThan(o.zero_velocity_threshold + o.doppler_quantization, points);
}

bool mostReadZero(const std::vector<RadarDirection>& points, const EgoVelocityOptions& o) {
  const auto zeros = static_cast<double>(selectZeros(points, o).size());
  return zeros >= (1.0 - o.zero_velocity_outlier_fraction) * static_cast<double>(points.size());
}

VelocitySolution solveRest(const std::vector<RadarDirection>& inliers, const PointVariances& noise,
                           const EgoVelocityOptions& o) {
  const Eigen::Vector3d v_R = Eigen::Vector3d::Zero();
  const DopplerLikelihood likelihood(inliers, v_R, noise);
  VelocitySolution rest = solutionOf(v_R, likelihood.at(v_R).information + likelihood.binInformation(), o);
  rest.covariance.diagonal().array() += square(o.zero_velocity_sigma);
  return rest;
}

bool directionsAgreeOnMotion(const std::vector<RadarDirection>& points, const EgoVelocityOptions& o) {
  struct Cell {
    double count = 0.0, approaching = 0.0;
    Eigen::Vector3d sum_R = Eigen::Vector3d::Zero();
  };
  const std::vector<RadarDirection> slow = selectSlow(points, o);
  if (std::all_of(slow.begin(), slow.end(), [&](const auto& p) { return readsZero(p, o); })) return false;
  // Number of cells along each axis of the unit cube. The middle cell is around zero.
  constexpr std::size_t kAlong = 9;
  static_assert(kAlong * kCellWidth > 2.0);
  std::vector<Cell> cells(kAlong * kAlong * kAlong);
  for (const RadarDirection& p : slow) {
    const Eigen::Vector3d at = p.u_R.array() / kCellWidth + 0.5 * kAlong;
    const auto index = [&](int axis) { return static_cast<std::size_t>(at[axis]); };
    Cell& cell = cells[(index(0) * kAlong + index(1)) * kAlong + index(2)];
    cell.count += 1.0;
    cell.sum_R += p.u_R;
    if (!readsZero(p, o)) cell.approaching -= std::copysign(1.0, p.doppler);
  }
  // Least squares: the share of a cell's points that approach is u . g, so it grows along the motion.
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double all = 0.0;
  double count = 0.0;  // of cells with points
  for (const Cell& cell : cells) {
    if (cell.count == 0.0) continue;
    count += 1.0;
    H += cell.sum_R * cell.sum_R.transpose() / cell.count;
    b += cell.sum_R * cell.approaching / cell.count;
    all += square(cell.approaching) / cell.count;
  }
  const double explained = b.dot(H.ldlt().solve(b));
  const double freedom = count - 3.0;
  if (!(freedom > 0.0)) return false;
  // The likelihood ratio of a Gaussian scatter that is not known.
  const double unexplained = std::max(0.0, all - explained);
  return freedom * std::log1p(explained / unexplained) > kDeniesRest;
}

std::optional<SlowVelocity> findSlowVelocity(const std::vector<RadarDirection>& points,
                                             const PointVariances& noise, const EgoVelocityOptions& o) {
  const std::vector<RadarDirection> slow = selectSlow(points, o);
  if (static_cast<double>(slow.size()) < kMajority * static_cast<double>(points.size())) return std::nullopt;
  const std::optional<VelocitySolution> first = fitSlowVelocity(slow, noise, o);
  if (!first) return std::nullopt;
  SlowVelocity found{*first, selectInliers(points, first->v_R, noise, o)};
  if (const auto refined = fitSlowVelocity(found.inliers, noise, o)) found.solution = *refined;
  return found;
}

}  // namespace rio_t
