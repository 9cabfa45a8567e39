#include "consensus.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include "direction_noise.h"
#include "velocity_solver.h"

namespace rio_t {
namespace {

constexpr int kSides[] = {0, -1, 1};  // [spans] by which a Doppler may have wrapped around

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

/// Velocity on which three directions agree. False if they lie (nearly) in a plane.
bool solveThree(const RadarDirection& a, const RadarDirection& b, const RadarDirection& c,
                Eigen::Vector3d& v_R) {
  const Eigen::Vector3d bc = b.u_R.cross(c.u_R);
  const double determinant = a.u_R.dot(bc);
  if (std::abs(determinant) < 1e-4) return false;
  v_R = (a.doppler * bc + b.doppler * c.u_R.cross(a.u_R) + c.doppler * a.u_R.cross(b.u_R)) / -determinant;
  return true;
}

/// Whether a velocity is near enough to the prior.
bool agrees(const VelocitySolution& solution, const VelocityPrior& prior, double gate) {
  const Eigen::Matrix3d covariance = prior.covariance + solution.covariance;
  const Eigen::Vector3d d = solution.v_R - prior.v_R;
  return solution.solved && d.dot(covariance.inverse() * d) <= gate * gate;
}

}  // namespace

int ransacIterations(const EgoVelocityOptions& o) {
  constexpr int kMax = 1000;
  const double clean_draw = std::pow(1.0 - o.ransac_outlier_probability, 3);
  if (clean_draw >= 1.0) return 1;
  const double n = std::ceil(std::log(1.0 - o.ransac_success_probability) / std::log1p(-clean_draw));
  return static_cast<int>(std::clamp(n, 1.0, static_cast<double>(kMax)));
}

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
      c.doppler += span * kSides[side / 9 % 3];
      Eigen::Vector3d v_R;
      if (!solveThree(a, b, c, v_R)) break;
      spans_space = true;
      offer(v_R);
    }
  }
  return spans_space ? std::make_optional(best_v_R) : std::nullopt;
}

std::vector<RadarDirection> selectInliers(const std::vector<RadarDirection>& points,
                                          const Eigen::Vector3d& v_R, const PointVariances& noise,
                                          const EgoVelocityOptions& o) {
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

std::vector<RadarDirection> selectInliersWithPrior(const std::vector<RadarDirection>& points,
                                                   std::vector<RadarDirection> inliers,
                                                   const VelocityPrior& prior, const PointVariances& noise,
                                                   const EgoVelocityOptions& o) {
  if (agrees(solveLeastSquares(inliers, o), prior, o.prior_gate)) return inliers;
  VelocitySolution near_prior;
  near_prior.v_R = prior.v_R;
  std::vector<RadarDirection> supporters;
  for (int round = 0; round < 2; ++round) {
    supporters = selectInliers(points, near_prior.v_R, noise, o);
    near_prior = solveLeastSquares(supporters, o);
    if (!near_prior.solved) return inliers;
  }
  const double least = o.prior_min_inlier_fraction * static_cast<double>(points.size());
  const bool are_enough = static_cast<double>(supporters.size()) >= least;
  return are_enough && agrees(near_prior, prior, o.prior_gate) ? supporters : inliers;
}

}  // namespace rio_t
