#include "rest_velocity.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>

#include "consensus.h"
#include "direction_noise.h"
#include "velocity_posterior.h"

namespace rio_t {
namespace {

/// Twice the log-likelihood ratio of a slow motion to rest: once in 1000 scans at rest (chi-squared, 3
/// degrees of freedom).
constexpr double kDeniesRest = 16.3;
/// [rad] 15 degrees, the beam of a radar with few antennas: the echoes of one object lie within it.
constexpr double kCellWidth = 0.26;

bool readsZero(const RadarDirection& p, const EgoVelocityOptions& o) {
  return std::abs(p.doppler) <= o.zero_velocity_threshold;
}

/// Minus the log-likelihood of rest if some of the points read the bin beside zero for reasons of their own,
/// on either side. DopplerLikelihood takes the points as independent, so it holds that so many of them cannot
/// be wrong by chance.
double restWithPointsBeside(const std::vector<RadarDirection>& points, const EgoVelocityOptions& o) {
  const auto n = static_cast<double>(points.size());
  const auto beside = static_cast<double>(
      std::count_if(points.begin(), points.end(), [&](const RadarDirection& p) { return !readsZero(p, o); }));
  const auto logOf = [](double count, double share) { return count > 0.0 ? count * std::log(share) : 0.0; };
  return -logOf(n - beside, (n - beside) / n) - logOf(beside, 0.5 * beside / n);
}

/// The likeliest velocity of `points`, which read at most one bin. None if rest is about as likely.
std::optional<VelocitySolution> fitSlowMotion(const std::vector<RadarDirection>& points,
                                              const PointVariances& noise, const EgoVelocityOptions& o) {
  if (points.size() < o.min_inliers) return std::nullopt;
  const bool has_bins = o.doppler_quantization > 0.0;
  if (has_bins && restWithPointsBeside(points, o) < 0.5 * kDeniesRest) return std::nullopt;
  VelocitySolution solution = solveLeastSquares(points, o);
  if (!solution.solved || solution.v_R.isZero()) return std::nullopt;
  const DopplerLikelihood likelihood(points, Eigen::Vector3d::Zero(), noise);
  double at_rest = likelihood.at(Eigen::Vector3d::Zero()).value;
  if (has_bins) at_rest = std::min(at_rest, restWithPointsBeside(points, o));
  if (at_rest < 0.5 * kDeniesRest) return std::nullopt;
  const LikeliestVelocity likeliest = findLikeliest(likelihood, std::nullopt, solution.v_R);
  if (2.0 * (at_rest - likeliest.cost.value) < kDeniesRest) return std::nullopt;
  solution.v_R = likeliest.v_R;
  // A point far within its bin adds nothing to the curvature: without noise, none may be left.
  Eigen::Matrix3d information = likeliest.cost.information;
  if (has_bins)
    information += binInformation(o.doppler_quantization, noise.doppler) * meanOuterProduct(points);
  solution.solved = information.determinant() > 0.0;
  solution.covariance = information.inverse();
  return solution;
}

}  // namespace

bool mostReadZero(const std::vector<RadarDirection>& points, const EgoVelocityOptions& o) {
  const auto zeros = static_cast<double>(
      std::count_if(points.begin(), points.end(), [&](const RadarDirection& p) { return readsZero(p, o); }));
  return zeros >= (1.0 - o.zero_velocity_outlier_fraction) * static_cast<double>(points.size());
}

std::vector<RadarDirection> selectZeros(const std::vector<RadarDirection>& points,
                                        const EgoVelocityOptions& o) {
  std::vector<RadarDirection> zeros;
  std::copy_if(points.begin(), points.end(), std::back_inserter(zeros),
               [&](const RadarDirection& p) { return readsZero(p, o); });
  return zeros;
}

std::vector<RadarDirection> selectSlow(const std::vector<RadarDirection>& points,
                                       const EgoVelocityOptions& o) {
  std::vector<RadarDirection> slow;
  std::copy_if(points.begin(), points.end(), std::back_inserter(slow), [&](const RadarDirection& p) {
    return std::abs(p.doppler) <= o.zero_velocity_threshold + o.doppler_quantization;
  });
  return slow;
}

// Every inlier reads the zero bin, of width q. Two things bound the velocity:
// - The bin; see binInformation.
// - The noise. Noise of sigma s carries readings over the edge of the bin, the sooner the faster the platform
//   creeps. The likelihood P(v) that a point reads zero has the curvature
//     -(log P)'' = 2 z phi(z) / (s^2 P(0)) at rest, z = q / (2 s),
//   for each of the n points (1/s^2 as q goes to 0, nothing if q is much above s).
// Unsolved if the directions leave some velocity unseen.
VelocitySolution solveRest(const std::vector<RadarDirection>& inliers, const PointVariances& noise,
                           const EgoVelocityOptions& o) {
  VelocitySolution solution;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(meanOuterProduct(inliers));
  if (!(eigen.eigenvalues()[0] * o.max_condition_number > eigen.eigenvalues()[2])) return solution;
  const double q = o.doppler_quantization;
  const double s = std::sqrt(noise.doppler);
  const auto n = static_cast<double>(inliers.size());
  const double z = s > 0.0 ? q / (2.0 * s) : 0.0;
  double scale = s * s / n;  // of M^-1; this is without a bin
  if (q > 0.0) {
    const double phi = std::exp(-0.5 * z * z) / std::sqrt(2.0 * M_PI);
    const double curvature = s > 0.0 ? 2.0 * z * phi / (s * s * std::erf(z / std::sqrt(2.0))) : 0.0;
    scale = 1.0 / (binInformation(q, noise.doppler) + n * curvature);
  }
  solution.covariance = o.zero_velocity_sigma * o.zero_velocity_sigma * Eigen::Matrix3d::Identity() +
                        scale * eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() *
                            eigen.eigenvectors().transpose();
  solution.solved = true;
  return solution;
}

bool directionsAgreeOnMotion(const std::vector<RadarDirection>& points, const EgoVelocityOptions& o) {
  struct Cell {
    double count = 0.0, approaching = 0.0;
    Eigen::Vector3d sum_R = Eigen::Vector3d::Zero();
  };
  std::map<std::array<long, 3>, Cell> cells;
  for (const RadarDirection& p : selectSlow(points, o)) {
    const Eigen::Vector3d corner = p.u_R / kCellWidth;
    Cell& cell = cells[{std::lround(corner.x()), std::lround(corner.y()), std::lround(corner.z())}];
    cell.count += 1.0;
    cell.sum_R += p.u_R;
    if (!readsZero(p, o)) cell.approaching -= std::copysign(1.0, p.doppler);
  }
  // Least squares: the share of a cell's points that approach is u . g, so it grows along the motion.
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double all = 0.0;
  for (const auto& [index, cell] : cells) {
    H += cell.sum_R * cell.sum_R.transpose() / cell.count;
    b += cell.sum_R * cell.approaching / cell.count;
    all += square(cell.approaching) / cell.count;
  }
  const double explained = b.dot(H.ldlt().solve(b));
  const double freedom = static_cast<double>(cells.size()) - 3.0;
  if (!(freedom > 0.0)) return false;
  // Quantile of the F distribution, within 4 % from 20 degrees of freedom on.
  const double limit = kDeniesRest / 3.0 * (1.0 + 9.0 / freedom);
  return explained / 3.0 > limit * (all - explained) / freedom;
}

std::optional<SlowMotion> findSlowMotion(const std::vector<RadarDirection>& points,
                                         const PointVariances& noise, const EgoVelocityOptions& o) {
  const std::vector<RadarDirection> slow = selectSlow(points, o);
  if (static_cast<double>(slow.size()) < kMajority * static_cast<double>(points.size())) return std::nullopt;
  const std::optional<VelocitySolution> first = fitSlowMotion(slow, noise, o);
  if (!first) return std::nullopt;
  SlowMotion found{*first, selectInliers(points, first->v_R, noise, o)};
  if (const auto refined = fitSlowMotion(found.inliers, noise, o)) found.solution = *refined;
  return found;
}

}  // namespace rio_t
