#include "rio_t/sensors/offset_step_detector.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "rio_t/core/fading.h"

namespace rio_t {
namespace {

constexpr double kMinCount = 30.0;   // of components: ten scans, since one may be an outlier
constexpr double kMinScatter = 0.2;  // of the variance: fewer scans than it seems may agree by chance

}  // namespace

bool OffsetStepDetector::showsStep(const Average& average) const {
  if (average.count < kMinCount || average.information <= 0.0) return false;
  const double change = average.projection / average.information;
  // The scatter that the change does not explain. S is an upper bound, so the scatter may well be below 1.
  const double scatter =
      std::max(kMinScatter, (average.squares - change * average.projection) / average.count);
  const double sigma = std::sqrt(scatter / average.information);
  return std::abs(change) >= std::max(options_.significance * sigma, options_.min_change) &&
         std::abs(change) <= max_change_;
}

bool OffsetStepDetector::stepped(const Innovation& innovation, const Eigen::Matrix3d& R_WR) {
  if (!options_.enabled) return false;
  const Time before = std::exchange(last_, innovation.stamp);
  const Eigen::LDLT<Eigen::Matrix3d> weight = innovation.S_at_offset.ldlt();
  const double squares = innovation.d.dot(weight.solve(innovation.d));
  double memory = options_.memory;
  for (Average& average : averages_) {
    const double fade = fading(before, innovation.stamp, memory);
    average.followed *= fade;
    const Eigen::Vector3d J = innovation.J_mean - R_WR.transpose() * average.followed;
    const Eigen::Vector3d weighted_J = weight.solve(J);
    average.information = fade * average.information + J.dot(weighted_J);
    average.projection = fade * average.projection + innovation.d.dot(weighted_J);
    average.squares = fade * average.squares + squares;
    average.count = fade * average.count + 3.0;
    memory *= 0.5;
  }
  const bool shows = std::any_of(averages_.begin(), averages_.end(),
                                 [this](const Average& average) { return showsStep(average); });
  if (shows) averages_ = {};
  return shows;
}

void OffsetStepDetector::follow(const Eigen::Vector3d& J_mean, const OffsetScan& scan) {
  for (Average& average : averages_) scan.follow(J_mean, average.followed);
}

}  // namespace rio_t
