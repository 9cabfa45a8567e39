#pragma once

#include "rio_t/core/time.h"
#include "rio_t/sensors/innovation.h"

namespace rio_t {

struct OffsetStepDetectorOptions {
  bool enabled = true;
  double memory = 4.0;         ///< [s] time constant of the average over scans
  double significance = 6.0;   ///< [sigma] of the offset that the innovations ask for, by itself
  double min_change = 5.0e-3;  ///< [s] smaller steps are left to the random walk of the offset
};

/// Watches whether the scans still agree with the time offset: a driver that restarts may step it by many
/// sigma, and a smoother that is sure of the old value would take minutes to follow.
///
/// An offset that is wrong by d shows as innovations nu = J d + noise, J = d(velocity)/d(t_O). The weighted
/// average over the last scans, sum(J' S^-1 nu) / sum(J' S^-1 J), is the change that they ask for, with the
/// variance 1 / sum(J' S^-1 J), scaled by how the innovations scatter against S (docs/method.md).
class OffsetStepDetector {
 public:
  explicit OffsetStepDetector(const OffsetStepDetectorOptions& options) : options_(options) {}

  /// True where the offset must have stepped; then the average starts anew. S is that without the offset's own
  /// uncertainty.
  bool stepped(const Innovation& innovation);

 private:
  OffsetStepDetectorOptions options_;  // read-only after construction
  Time last_;
  double information_ = 0.0;  ///< sum J' S^-1 J, fading
  double projection_ = 0.0;   ///< sum J' S^-1 nu, fading
  double squares_ = 0.0;      ///< sum nu' S^-1 nu, fading
  double count_ = 0.0;        ///< sum 3, fading
};

}  // namespace rio_t
