#include "rio_t/sensors/offset_step_detector.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace rio_t {
namespace {

/// [s] A person who walks by may pull the velocity for this long, which looks like a step. After a true step,
/// every later scan shows the same change.
constexpr double kPull = 1.0;
constexpr double kMinScatter = 0.2;  // share of the variance: a few scans may scatter less by chance

}  // namespace

bool OffsetStepDetector::isStep(const Candidate& candidate, double t_O) const {
  const Sums& all = candidate.all;
  const double change = all.projection / all.information;
  if (std::abs(change) < options_.min_change || std::abs(t_O + change) > max_time_offset_) return false;
  // The scatter that the change does not explain. S is an upper bound, so the scatter may well be below 1.
  const double scatter =
      std::max(kMinScatter, (candidate.squares - change * all.projection) / candidate.count);
  const auto isSignificant = [&](const Sums& sums) {
    return sums.information > 0.0 && std::copysign(1.0, change) * sums.projection >=
                                         options_.significance * std::sqrt(scatter * sums.information);
  };
  return isSignificant(all) && isSignificant(candidate.late);
}

std::optional<OffsetStep> OffsetStepDetector::stepped(const Innovation& innovation,
                                                      const Eigen::Matrix3d& R_WR, double t_O) {
  if (!options_.enabled) return std::nullopt;
  while (!candidates_.empty() && innovation.stamp - candidates_.front().first > options_.memory)
    candidates_.pop_front();
  candidates_.emplace_back();
  candidates_.back().first = innovation.stamp;

  const Eigen::Matrix3d weight_W = R_WR * innovation.S_at_offset.inverse() * R_WR.transpose();
  const Eigen::Vector3d J_W = R_WR * innovation.J_mean;
  const Eigen::Vector3d d_W = R_WR * innovation.d;
  const Eigen::Vector3d weighted_d = weight_W * d_W;
  const double squares = d_W.dot(weighted_d);
  const Candidate* best = nullptr;
  double best_fit = 0.0;  // twice the logarithm of its likelihood ratio
  for (Candidate& candidate : candidates_) {
    if (innovation.stamp < candidate.first) continue;
    const Eigen::Vector3d G_W = J_W - candidate.followed;
    const Sums added{G_W.dot(weight_W * G_W), G_W.dot(weighted_d)};
    candidate.all += added;
    if (innovation.stamp - candidate.first >= kPull) candidate.late += added;
    candidate.squares += squares;
    candidate.count += 3.0;
    const double fit = candidate.all.projection * candidate.all.projection / candidate.all.information;
    if (!(fit > best_fit)) continue;  // also if there is no information
    best_fit = fit;
    best = &candidate;
  }
  if (best == nullptr || !isStep(*best, t_O)) return std::nullopt;
  const OffsetStep step{best->first, best->all.projection / best->all.information};
  candidates_.clear();
  return step;
}

void OffsetStepDetector::follow(Time stamp, const Eigen::Vector3d& J_mean, const OffsetScan& scan) {
  const Eigen::Matrix3d R_WR = scan.R_WR();
  const Eigen::Matrix3d share_W = R_WR * scan.share() * R_WR.transpose();
  const Eigen::Vector3d J_W = R_WR * J_mean;
  for (Candidate& candidate : candidates_)
    if (stamp >= candidate.first) candidate.followed += share_W * (J_W - candidate.followed);
}

}  // namespace rio_t
