#include "rio_t/evaluation/errors.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "rio_t/core/angle.h"
#include "rio_t/core/so3.h"

namespace rio_t {
namespace {

/// Angle between two orientations [deg].
double angleDegrees(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return so3::log(a.conjugate() * b).norm() / kDegree;
}

/// Heading of the x axis of `q` [rad].
double yaw(const Eigen::Quaterniond& q) {
  const Eigen::Vector3d x = q * Eigen::Vector3d::UnitX();
  return std::atan2(x.y(), x.x());
}

/// Heading of `estimate` minus that of `truth`, the short way round [deg].
double yawDegrees(const Eigen::Quaterniond& truth, const Eigen::Quaterniond& estimate) {
  return std::remainder(yaw(estimate) - yaw(truth), 2.0 * M_PI) / kDegree;
}

Statistics statistics(std::vector<double> values) {
  Statistics s;
  if (values.empty()) return s;
  const double n = static_cast<double>(values.size());
  s.mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  s.rmse = std::sqrt(std::inner_product(values.begin(), values.end(), values.begin(), 0.0) / n);
  std::sort(values.begin(), values.end());
  s.max = values.back();
  const std::size_t middle = values.size() / 2;
  s.median = values.size() % 2 == 1 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
  return s;
}

std::vector<Match> requireMatches(const Trajectory& truth, const Trajectory& estimate,
                                  double max_difference) {
  std::vector<Match> matches = associate(truth, estimate, max_difference);
  if (matches.empty()) {
    throw std::invalid_argument("no pose of the estimate has a stamp within " +
                                std::to_string(max_difference) + " s of one of the ground truth (" +
                                std::to_string(estimate.size()) + " and " + std::to_string(truth.size()) +
                                " poses)");
  }
  return matches;
}

using Points = Eigen::Matrix3Xd;

Points positions(const Trajectory& trajectory, const std::vector<Match>& matches, std::size_t Match::*which) {
  Points p(3, matches.size());
  for (std::size_t i = 0; i < matches.size(); ++i) {
    p.col(static_cast<Eigen::Index>(i)) = trajectory[matches[i].*which].p_W;
  }
  return p;
}

/// Rotation that minimises sum |truth - R estimate|^2 of centred points.
Eigen::Matrix3d leastSquaresRotation(const Points& truth, const Points& estimate) {
  const Eigen::Matrix3d covariance = truth * estimate.transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d& d = svd.singularValues();
  if (d[1] <= 1e-12 * d[0] || d[0] <= 0.0) {
    throw std::invalid_argument("SE3 alignment needs three matched positions that are not on a line");
  }
  // If the best orthogonal matrix is a reflection, the last axis is flipped.
  Eigen::Vector3d sign = Eigen::Vector3d::Ones();
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0) sign.z() = -1.0;
  return svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
}

/// As leastSquaresRotation, with a rotation about z only.
Eigen::Matrix3d leastSquaresYaw(const Points& truth, const Points& estimate) {
  const double along = truth.row(0).dot(estimate.row(0)) + truth.row(1).dot(estimate.row(1));
  const double across = truth.row(1).dot(estimate.row(0)) - truth.row(0).dot(estimate.row(1));
  if (std::hypot(along, across) <= 0.0) {
    throw std::invalid_argument("yaw alignment needs matched positions some horizontal distance apart");
  }
  return Eigen::AngleAxisd(std::atan2(across, along), Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

/// Length of the estimate's step to each match, in the unit of the pieces; the first is zero.
std::vector<double> steps(const Trajectory& estimate, const std::vector<Match>& matches, DeltaUnit unit) {
  std::vector<double> lengths(matches.size(), 0.0);
  for (std::size_t i = 1; i < matches.size(); ++i) {
    const StampedPose& a = estimate[matches[i - 1].estimate];
    const StampedPose& b = estimate[matches[i].estimate];
    lengths[i] = unit == DeltaUnit::kMetres ? (b.p_W - a.p_W).norm() : b.time - a.time;
  }
  return lengths;
}

using Pair = std::pair<std::size_t, std::size_t>;

/// Each piece begins where the one before ended.
std::vector<Pair> consecutivePairs(const std::vector<double>& lengths, double delta) {
  std::vector<Pair> pairs;
  bool started = false;
  std::size_t last = 0;
  double sum = 0.0;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    sum += lengths[i];
    if (sum < delta) continue;
    if (started) pairs.emplace_back(last, i);
    started = true;
    last = i;
    sum = 0.0;
  }
  return pairs;
}

/// Pairs every pose with the pose nearest to `delta` further on. Of equally near ones it takes the first.
std::vector<Pair> allPairs(const std::vector<double>& lengths, double delta) {
  std::vector<double> at(lengths.size());
  std::partial_sum(lengths.begin(), lengths.end(), at.begin());
  const double tolerance = 0.1 * delta;
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i + 1 < at.size(); ++i) {
    const double target = at[i] + delta;
    const auto from = at.begin() + static_cast<std::ptrdiff_t>(i) + 1;
    auto nearest = std::lower_bound(from, at.end(), target);
    if (nearest == at.end() || (nearest != from && target - *(nearest - 1) <= *nearest - target)) {
      nearest = std::lower_bound(from, at.end(), *(nearest - 1));
    }
    if (std::abs(*nearest - target) > tolerance) continue;
    pairs.emplace_back(i, static_cast<std::size_t>(nearest - at.begin()));
  }
  return pairs;
}

StampedPose transformed(const RigidTransform& T_TE, const StampedPose& pose) {
  return {pose.time, T_TE.q_TE * pose.p_W + T_TE.t_T, (T_TE.q_TE * pose.q_WI).normalized()};
}

}  // namespace

RigidTransform alignment(const Trajectory& truth, const Trajectory& estimate,
                         const std::vector<Match>& matches, Alignment kind) {
  RigidTransform T_TE;
  if (kind == Alignment::kNone) return T_TE;
  if (matches.empty()) throw std::invalid_argument("alignment needs at least one matched pose");
  if (kind == Alignment::kOrigin) {
    const StampedPose& t = truth[matches.front().truth];
    const StampedPose& e = estimate[matches.front().estimate];
    T_TE.q_TE = (t.q_WI * e.q_WI.conjugate()).normalized();
    T_TE.t_T = t.p_W - T_TE.q_TE * e.p_W;
    return T_TE;
  }
  Points t = positions(truth, matches, &Match::truth);
  Points e = positions(estimate, matches, &Match::estimate);
  const Eigen::Vector3d mean_t = t.rowwise().mean();
  const Eigen::Vector3d mean_e = e.rowwise().mean();
  t.colwise() -= mean_t;
  e.colwise() -= mean_e;
  T_TE.q_TE = kind == Alignment::kYaw ? leastSquaresYaw(t, e) : leastSquaresRotation(t, e);
  T_TE.t_T = mean_t - T_TE.q_TE * mean_e;
  return T_TE;
}

std::vector<PoseError> poseErrors(const Trajectory& truth, const Trajectory& estimate, Alignment kind,
                                  double max_difference) {
  const std::vector<Match> matches = requireMatches(truth, estimate, max_difference);
  const RigidTransform T_TE = alignment(truth, estimate, matches, kind);
  std::vector<PoseError> errors;
  errors.reserve(matches.size());
  for (const Match& match : matches) {
    const StampedPose& t = truth[match.truth];
    const StampedPose e = transformed(T_TE, estimate[match.estimate]);
    errors.push_back({e.time, e.p_W, t.p_W, angleDegrees(t.q_WI, e.q_WI), yawDegrees(t.q_WI, e.q_WI)});
  }
  return errors;
}

AbsoluteError absoluteError(const Trajectory& truth, const Trajectory& estimate, Alignment kind,
                            double max_difference) {
  std::vector<double> metres;
  std::vector<double> degrees;
  for (const PoseError& error : poseErrors(truth, estimate, kind, max_difference)) {
    metres.push_back((error.p_T - error.truth_T).norm());
    degrees.push_back(error.angle_deg);
  }
  const std::size_t count = metres.size();
  return {statistics(std::move(metres)), statistics(std::move(degrees)), count};
}

RelativeError relativeError(const Trajectory& truth, const Trajectory& estimate,
                            const RelativeErrorOptions& options, double max_difference) {
  if (!(options.delta > 0.0)) throw std::invalid_argument("relative error: delta must be greater than zero");
  const std::vector<Match> matches = requireMatches(truth, estimate, max_difference);
  const std::vector<double> lengths = steps(estimate, matches, options.unit);
  // Half a nanosecond absorbs the rounding of sums of stamps. Otherwise equal periods could give pieces of
  // unequal length. Metres are compared without tolerance, as in evo.
  const double delta = options.unit == DeltaUnit::kSeconds ? options.delta - 0.5e-9 : options.delta;
  const std::vector<Pair> pairs =
      options.all_pairs ? allPairs(lengths, options.delta) : consecutivePairs(lengths, delta);

  std::vector<double> metres;
  std::vector<double> degrees;
  for (const auto& [i, j] : pairs) {
    const StampedPose& ti = truth[matches[i].truth];
    const StampedPose& tj = truth[matches[j].truth];
    const StampedPose& ei = estimate[matches[i].estimate];
    const StampedPose& ej = estimate[matches[j].estimate];
    const Eigen::Vector3d motion_t = ti.q_WI.conjugate() * (tj.p_W - ti.p_W);
    const Eigen::Vector3d motion_e = ei.q_WI.conjugate() * (ej.p_W - ei.p_W);
    metres.push_back((motion_e - motion_t).norm());
    degrees.push_back(angleDegrees(ti.q_WI.conjugate() * tj.q_WI, ei.q_WI.conjugate() * ej.q_WI));
  }
  return {statistics(std::move(metres)), statistics(std::move(degrees)), pairs.size()};
}

Drift drift(const Trajectory& truth, const Trajectory& estimate, double max_difference) {
  const std::vector<Match> matches = requireMatches(truth, estimate, max_difference);
  const PoseError last = poseErrors(truth, estimate, Alignment::kOrigin, max_difference).back();
  Drift result;
  for (std::size_t i = matches.front().truth + 1; i <= matches.back().truth; ++i) {
    result.path_m += (truth[i].p_W - truth[i - 1].p_W).norm();
  }
  const Eigen::Vector3d error = last.p_T - last.truth_T;
  result.final_m = error.norm();
  result.final_horizontal_m = error.head<2>().norm();
  result.final_yaw_deg = last.yaw_deg;
  if (result.path_m > 0.0) result.per_metre = result.final_m / result.path_m;
  return result;
}

}  // namespace rio_t
