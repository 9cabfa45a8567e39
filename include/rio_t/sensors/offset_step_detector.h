#pragma once

#include <deque>
#include <optional>

#include "rio_t/core/time.h"
#include "rio_t/sensors/innovation.h"
#include "rio_t/sensors/offset_evidence.h"

namespace rio_t {

struct OffsetStepDetectorOptions {
  bool enabled = true;
  double memory = 8.0;         ///< [s] an older step is not found any more
  double significance = 6.0;   ///< [sigma] of the change that fits the innovations
  double min_change = 5.0e-3;  ///< [s] the random walk of the offset follows smaller steps
};

struct OffsetStep {
  Time first;           ///< stamp of the first scan after it
  double change = 0.0;  ///< of t_O [s]
};

/// Detects steps of the time offset. A driver that restarts may change the offset by many sigma, and a
/// smoother with a small sigma of the old value would take minutes to follow.
///
/// If the offset stepped by c before a scan k, the innovations of k and of the scans after it are
/// d = c G + noise. G is what the estimated velocity has not followed yet, since k, of
/// J = d(velocity)/d(t_O). For each k of the last seconds, sum(G' S^-1 d) / sum(G' S^-1 G) is the change that
/// fits best, and 1 / sum(G' S^-1 G) its variance, scaled by the scatter of the innovations against S. The k
/// that fits best of all is the first scan after the step (docs/method.md, eq. 32; A. S. Willsky and
/// H. L. Jones, "A generalized likelihood ratio approach to the detection and estimation of jumps in linear
/// systems", IEEE Trans. Automatic Control, 1976). Not thread-safe.
class OffsetStepDetector {
 public:
  /// The offset stays within `max_time_offset` [s].
  OffsetStepDetector(const OffsetStepDetectorOptions& options, double max_time_offset)
      : options_(options), max_time_offset_(max_time_offset) {}

  /// If the offset has stepped, returns the step and begins anew. S is here S_at_offset, without the
  /// uncertainty of the offset. `R_WR` turns R into W at the scan, and `t_O` [s] is the offset before the
  /// step.
  std::optional<OffsetStep> stepped(const Innovation& innovation, const Eigen::Matrix3d& R_WR, double t_O);
  /// Call it if the window has taken the scan and follows its velocity. `stamp`, `J_mean`: of the innovation.
  void follow(Time stamp, const Eigen::Vector3d& J_mean, const OffsetScan& scan);

 private:
  struct Sums {
    double information = 0.0;  ///< of G' S^-1 G
    double projection = 0.0;   ///< of G' S^-1 d
    void operator+=(const Sums& added) {
      information += added.information;
      projection += added.projection;
    }
  };
  /// A step just before the scan `first`, as the scans since then see it.
  struct Candidate {
    Time first;
    Sums all, late;        ///< over all these scans, and without those of the first second
    double squares = 0.0;  ///< sum of d' S^-1 d
    double count = 0.0;    ///< of the components of d
    /// How far the scans have moved the velocity, in W, for each second of the step [m/s^2].
    Eigen::Vector3d followed = Eigen::Vector3d::Zero();
  };
  bool isStep(const Candidate& candidate, double t_O) const;

  OffsetStepDetectorOptions options_;  // read-only after construction, as the next
  double max_time_offset_;
  std::deque<Candidate> candidates_;  ///< of the last `memory`
};

}  // namespace rio_t
