#pragma once

#include <array>

#include "rio_t/core/time.h"
#include "rio_t/sensors/innovation.h"
#include "rio_t/sensors/offset_evidence.h"

namespace rio_t {

struct OffsetStepDetectorOptions {
  bool enabled = true;
  double memory = 4.0;         ///< [s] longest time constant of the average over scans
  double significance = 6.0;   ///< [sigma] of the change that the innovations ask for
  double min_change = 5.0e-3;  ///< [s] the random walk of the offset follows smaller steps
};

/// Detects steps of the time offset. A driver that restarts may change the offset by many sigma, and a
/// smoother that is sure of the old value would take minutes to follow.
///
/// An offset that is wrong by c shows as innovations d = J c + noise, where J is what the estimated velocity
/// has not followed yet of d(velocity)/d(t_O). The weighted average over the last scans,
/// sum(J' S^-1 d) / sum(J' S^-1 J), is the change that they ask for. The variance of this change is
/// 1 / sum(J' S^-1 J), scaled by the scatter of the innovations against S (docs/method.md, eq. 32). Several
/// averages run side by side, each over half the time of the one before: a long one sees small steps, and a
/// short one sees a step before the scans from before it are forgotten.
class OffsetStepDetector {
 public:
  /// `max_time_offset` [s] is the bound of the offset: no step is longer than from bound to bound.
  OffsetStepDetector(const OffsetStepDetectorOptions& options, double max_time_offset)
      : options_(options), max_change_(2.0 * max_time_offset) {}

  /// True if the offset has stepped; the averages then start again. S is here S_at_offset, without the
  /// uncertainty of the offset. `R_WR` turns R into W at the scan.
  bool stepped(const Innovation& innovation, const Eigen::Matrix3d& R_WR);
  /// The window has taken the scan, and its velocity follows it. `J_mean` as in the innovation.
  void follow(const Eigen::Vector3d& J_mean, const OffsetScan& scan);

 private:
  /// Sums over the scans, fading.
  struct Average {
    double information = 0.0;  ///< J' S^-1 J
    double projection = 0.0;   ///< J' S^-1 d
    double squares = 0.0;      ///< d' S^-1 d
    double count = 0.0;        ///< 3
    /// If the offset stepped by one second when this average began, the scans have moved the velocity by
    /// this, in W [m/s^2].
    Eigen::Vector3d followed = Eigen::Vector3d::Zero();
  };
  bool showsStep(const Average& average) const;

  OffsetStepDetectorOptions options_;  // read-only after construction, as the next
  double max_change_;                  ///< [s]
  Time last_;
  std::array<Average, 4> averages_;  ///< the first over `memory`
};

}  // namespace rio_t
