#include "rio_t/inspection/mounting_search.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "mounting_cost.h"
#include "rio_t/core/so3.h"

namespace rio_t {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kMinDuration = 3.0;    // [s] of motion; with less, the search gives no result
constexpr double kOffsetStep = 0.01;    // [s]
constexpr double kLevelSigma = 0.17;    // [rad] of the roll, if nothing else is known
constexpr double kAheadSigma = 0.5;     // [rad] of the pitch, likewise
constexpr double kUprightWeight = 9.0;  // [sigma^2] upside down costs four times this more than upright
constexpr double kClear = 25.0;         // [sigma^2] a sign that fits better by this counts as known
constexpr double kAlike = 2.0;          // errors within a window are correlated: they count as half as many
constexpr double kOffsetFactor = 3.0;   // widens the sigma: noisy points shift the bottom of the curve

/// A mounting M = sign R, and what it costs.
struct Found {
  int sign = 1;
  Matrix3d R = Matrix3d::Identity();
  double cost = std::numeric_limits<double>::infinity();
};

/// The value of a cost that depends on M alone.
double costOf(const Quadratic& cost, const Matrix3d& M) {
  const VectorXd m = columnsOf(M);
  return m.dot(cost.H * m) - 2.0 * cost.b.dot(m) + cost.c;
}

/// Adds a weak prior for a mounting that the motion does not show: the radar is upright, does not roll and
/// looks ahead. So its right axis is level, and its forward axis nearly so. In M = sign R a level axis costs
/// the same for both signs.
Quadratic withUpright(Quadratic cost, const std::optional<Vector3d>& up_I, int sign) {
  if (!up_I) return cost;
  VectorXd level = VectorXd::Zero(kMountingM), ahead = VectorXd::Zero(kMountingM),
           upright = VectorXd::Zero(kMountingM);
  level.head<3>() = *up_I;
  ahead.segment<3>(3) = *up_I;
  upright.tail<3>() = sign * *up_I;
  cost.H += level * level.transpose() / (kLevelSigma * kLevelSigma);
  cost.H += ahead * ahead.transpose() / (kAheadSigma * kAheadSigma);
  cost.b += kUprightWeight * upright;
  return cost;
}

/// d vec(M) / d theta for M = sign R Exp(theta).
MatrixXd tangent(const Matrix3d& M) {
  MatrixXd J(kMountingM, 3);
  for (int k = 0; k < 3; ++k) {
    const Matrix3d D = M * so3::hat(Vector3d::Unit(k));
    J.col(k) = columnsOf(D);
  }
  return J;
}

/// Returns the rotation near `start` that costs least, by Levenberg-Marquardt.
Found descend(const Quadratic& cost, int sign, const Matrix3d& start) {
  Eigen::Quaterniond q(start);
  double lambda = 1e-3;
  double now = costOf(cost, sign * start);
  for (int i = 0; i < 50; ++i) {
    const Matrix3d M = sign * q.toRotationMatrix();
    const MatrixXd J = tangent(M);
    const Vector3d gradient = J.transpose() * (cost.H * columnsOf(M) - cost.b);
    Matrix3d hessian = J.transpose() * cost.H * J;
    hessian.diagonal().array() += lambda * (hessian.trace() / 3.0 + 1e-9);
    const Vector3d step = -hessian.ldlt().solve(gradient);
    const Eigen::Quaterniond next = (q * so3::exp(step)).normalized();
    const double then = costOf(cost, sign * next.toRotationMatrix());
    if (then <= now) {
      q = next;
      lambda = std::max(lambda * 0.2, 1e-9);
      if (now - then < 1e-9 * (1.0 + std::abs(now)) && step.norm() < 1e-7) break;
      now = then;
    } else {
      lambda *= 10.0;
      if (lambda > 1e9) break;
    }
  }
  return {sign, q.toRotationMatrix(), now};
}

Found descendFromAllTurns(const Quadratic& cost, int sign) {
  Found best;
  for (const Matrix3d& turn : axisTurns()) {
    const Found found = descend(cost, sign, turn);
    if (found.cost < best.cost) best = found;
  }
  return best;
}

/// The costs over the offset, each with the best rotation.
struct Curve {
  std::vector<double> costs;  // a value for each step of the offset
  Found least;                // the mounting that costs least over all offsets
};
using BySign = std::array<Curve, 2>;  // receding, approaching

/// Tries the offsets from `first` to `last` [steps] with both signs. `near`: rotations to start from.
BySign tryOffsets(int first, int last, const std::optional<Matrix3d>& M,
                  const std::optional<std::array<Matrix3d, 2>>& near, const MountingProblem& problem) {
  BySign curves;
  for (std::size_t s = 0; s < 2; ++s) curves[s].least.sign = s == 0 ? 1 : -1;
  if (near)
    for (std::size_t s = 0; s < 2; ++s) curves[s].least.R = (*near)[s];
  for (int k = first; k <= last; ++k) {
    const Quadratic cost = withoutLast(mountingCost(k * kOffsetStep, M, problem), kMountingL);
    for (Curve& curve : curves) {
      const int sign = curve.least.sign;
      const Quadratic whole = withUpright(cost, problem.options.up_I, sign);
      const Found found = near ? descend(whole, sign, curve.least.R) : descendFromAllTurns(whole, sign);
      curve.costs.push_back(found.cost);
      if (found.cost < curve.least.cost) curve.least = found;
    }
  }
  return curves;
}

/// Chooses the sign that fits better. If neither does so clearly, the ranges decide. `unit` is the cost of
/// one independent sigma^2.
void chooseSign(const BySign& curves, double unit, int sign_from_ranges, MountingSearch* result) {
  const double difference = (curves[1].least.cost - curves[0].least.cost) / unit;  // > 0: receding is better
  const int likelier = difference < 0.0 ? -1 : 1;
  // The IMU must be twice as sure if it contradicts the ranges.
  const bool contradicts = sign_from_ranges != 0 && sign_from_ranges != likelier;
  const bool imu_tells = std::abs(difference) > (contradicts ? 4.0 * kClear : kClear);
  result->sign_significance = std::abs(difference);
  result->mirrored = imu_tells && contradicts;
  result->sign = imu_tells ? likelier : (sign_from_ranges != 0 ? sign_from_ranges : 1);
}

/// Sets the offset at the bottom of the curve, and its sigma from the curvature there; returns the lowest
/// step. `steps`: the farthest one.
int findOffset(const std::vector<double>& costs, int first, int steps, double scale, MountingSearch* result) {
  const auto bottom = static_cast<int>(std::min_element(costs.begin(), costs.end()) - costs.begin());
  const int inner = std::clamp(bottom, 1, static_cast<int>(costs.size()) - 2);
  const auto at = [&](int i) { return costs[static_cast<std::size_t>(i)]; };
  const double curvature = (at(inner - 1) - 2.0 * at(inner) + at(inner + 1)) / (kOffsetStep * kOffsetStep);
  const double slope = (at(inner + 1) - at(inner - 1)) / (2.0 * kOffsetStep);
  const double step = curvature > 0.0 ? std::clamp(-slope / curvature, -kOffsetStep, kOffsetStep) : 0.0;
  result->offset = (first + inner) * kOffsetStep + step;
  const bool at_the_end = std::abs(first + bottom) == steps;
  const double sigma =
      curvature > 0.0 && !at_the_end ? std::sqrt(2.0 * scale / curvature) : steps * kOffsetStep;
  result->offset_sigma = std::max(kOffsetFactor * sigma, 0.002);
  return first + bottom;
}

/// Returns half the second derivative of the cost with respect to a turn in R, with no negative eigenvalue.
/// It includes the second derivative of M. Without that, the noise of the velocities, which costs the same
/// for all rotations, would count as information.
Matrix3d curvature(const Quadratic& cost, const Matrix3d& M) {
  const MatrixXd J = tangent(M);
  const VectorXd gradient = cost.H * columnsOf(M) - cost.b;
  Matrix3d sum = J.transpose() * cost.H * J;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const Matrix3d by_i = so3::hat(Vector3d::Unit(i)), by_j = so3::hat(Vector3d::Unit(j));
      sum(i, j) += gradient.dot(columnsOf(0.5 * M * (by_i * by_j + by_j * by_i)));
    }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> axes(sum);
  return axes.eigenvectors() * axes.eigenvalues().cwiseMax(0.0).asDiagonal() *
         axes.eigenvectors().transpose();
}

/// Sets the sigmas by the data alone, without the prior. `cost` depends only on M and has the same variance
/// on all axes. `H_l` is the information about the lever arm.
void setSigmas(const Quadratic& cost, const Matrix3d& H_l, double unit, MountingSearch* result) {
  const Matrix3d R = result->q_IR.toRotationMatrix();
  const Matrix3d in_R = curvature(cost, result->sign * R) / unit;
  const Matrix3d in_I = R * in_R * R.transpose();
  const Matrix3d covariance = (in_I + Matrix3d::Identity() / (M_PI * M_PI)).inverse();
  result->rotation_sigma = covariance.diagonal().cwiseSqrt();
  result->lever_arm_sigma = std::sqrt(unit) * H_l.inverse().diagonal().cwiseSqrt();
}

/// If another mounting, far off, fits as well, its axis counts as not observed. A vehicle that only drives
/// ahead does not show whether its radar is upside down.
void findOtherMounting(const Quadratic& cost, double square, MountingSearch* result) {
  constexpr double kFar = 1.0;  // [rad]
  const Matrix3d R = result->q_IR.toRotationMatrix();
  const double least = descend(cost, result->sign, R).cost;
  for (const Matrix3d& turn : axisTurns()) {
    const Found other = descend(cost, result->sign, turn);
    const Vector3d between = so3::log(Eigen::Quaterniond(other.R * R.transpose()).normalized());
    if (between.norm() < kFar || (other.cost - least) / square > kClear) continue;
    for (int k = 0; k < 3; ++k) {
      if (std::abs(between[k]) > 0.5 * between.norm()) result->rotation_sigma[k] = M_PI;
    }
  }
}

/// [s]
double durationOf(const std::vector<VelocityWindow>& windows) {
  double duration = 0.0;
  for (const VelocityWindow& window : windows)
    duration += window.back().velocity->stamp - window.front().velocity->stamp;
  return duration;
}

}  // namespace

const std::array<Matrix3d, 24>& axisTurns() {
  static const std::array<Matrix3d, 24> all = [] {
    std::array<Matrix3d, 24> turns;
    std::size_t n = 0;
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) {
        if (a == b) continue;
        for (const double s : {1.0, -1.0}) {
          for (const double t : {1.0, -1.0}) {
            Matrix3d R;
            R.col(0) = s * Vector3d::Unit(a);
            R.col(1) = t * Vector3d::Unit(b);
            R.col(2) = R.col(0).cross(R.col(1));
            turns[n++] = R;
          }
        }
      }
    }
    return turns;
  }();
  return all;
}

MountingSearch searchMounting(const std::vector<RadarVelocity>& velocities, const InertialTrack& track,
                              const MountingSearchOptions& options) {
  MountingSearch result;
  MountingProblem problem{track, options, windowsOf(velocities, track, kMaxSearchedOffset + 0.05)};
  result.enough = durationOf(problem.windows) >= kMinDuration;
  if (!result.enough) return result;

  // The first round tries all offsets. The later ones try those around the best, with the noise that was
  // found.
  constexpr int kRounds = 3, kNear = 5;
  const int steps = static_cast<int>(std::lround(kMaxSearchedOffset / kOffsetStep));
  int middle = 0;
  double scale = 1.0;
  std::optional<Matrix3d> M;
  std::optional<std::array<Matrix3d, 2>> near;
  Matrix3d H_l;  // the information about the lever arm
  for (int round = 0; round < kRounds; ++round) {
    const int reach = round == 0 ? steps : kNear;
    const int first = std::max(-steps, middle - reach), last = std::min(steps, middle + reach);
    const BySign curves = tryOffsets(first, last, M, near, problem);
    chooseSign(curves, kAlike * scale, options.sign_from_ranges, &result);
    const std::size_t s = result.sign == 1 ? 0 : 1;
    middle = findOffset(curves[s].costs, first, steps, scale, &result);

    const Quadratic with_lever_arm = mountingCost(result.offset, M, problem);
    const Quadratic cost = withoutLast(with_lever_arm, kMountingL);
    near = {curves[0].least.R, curves[1].least.R};
    Matrix3d& R = (*near)[s];
    R = descend(withUpright(cost, options.up_I, result.sign), result.sign, R).R;
    M = result.sign * R;
    result.q_IR = Eigen::Quaterniond(R);
    H_l = with_lever_arm.H.bottomRightCorner(kMountingL, kMountingL);
    result.lever_arm_I =
        H_l.inverse() * (with_lever_arm.b.tail(kMountingL) -
                         with_lever_arm.H.bottomLeftCorner(kMountingL, kMountingM) * columnsOf(*M));
    scale = reweigh(result.offset, *M, result.lever_arm_I, &problem);
  }
  // Here each velocity has one variance for all axes. With covariances that M turns, any other turn would put
  // the noisy axis where little noise is expected, and noise would look like evidence.
  const Quadratic even = withoutLast(mountingCost(result.offset, std::nullopt, problem), kMountingL);
  setSigmas(even, H_l, kAlike * scale, &result);
  findOtherMounting(even, kAlike * scale, &result);
  return result;
}

}  // namespace rio_t
