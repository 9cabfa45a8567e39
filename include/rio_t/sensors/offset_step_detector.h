#pragma once

#include "rio_t/core/time.h"
#include "rio_t/sensors/innovation.h"

namespace rio_t {

struct OffsetStepDetectorOptions {
  bool enabled = true;
  double memory = 4.0;         ///< [s] time constant of the average over scans
  double significance = 6.0;   ///< [sigma] of the change that the innovations ask for
  double min_change = 5.0e-3;  ///< [s] the random walk of the offset follows smaller steps
};

/// Detects steps of the time offset. A driver that restarts may change the offset by many sigma, and a
/// smoother that is sure of the old value would take minutes to follow.
///
/// An offset that is wrong by c shows as innovations d = J c + noise, J = d(velocity)/d(t_O). The weighted
/// average over the last scans, sum(J' S^-1 d) / sum(J' S^-1 J), is the change that they ask for. The
/// variance of this change is 1 / sum(J' S^-1 J), scaled by the scatter of the innovations against S
/// (docs/method.md, eq. 32).
class OffsetStepDetector {
 public:
  explicit OffsetStepDetector(const OffsetStepDetectorOptions& options) : options_(options) {}

  /// True if the offset has stepped; the average then starts again. S is here S_at_offset, without the
  /// uncertainty of the offset.
  bool stepped(const Innovation& innovation);

 private:
  OffsetStepDetectorOptions options_;  // read-only after construction
  Time last_;
  double information_ = 0.0;  ///< sum J' S^-1 J, fading
  double projection_ = 0.0;   ///< sum J' S^-1 d, fading
  double squares_ = 0.0;      ///< sum d' S^-1 d, fading
  double count_ = 0.0;        ///< sum 3, fading
};

}  // namespace rio_t
