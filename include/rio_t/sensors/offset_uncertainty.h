#pragma once

#include "rio_t/core/time.h"
#include "rio_t/sensors/innovation.h"

namespace rio_t {

/// Uncertainty of the time offset (docs/method.md, eq. 32b): its marginal variance plus the square of its
/// lag. If the offset drifts, its estimate lags, and all scans show the same change. Not thread-safe.
class OffsetUncertainty {
 public:
  /// `huber_threshold` on the root of d' S^-1 d, as on the radar factors; 0: no robust loss.
  explicit OffsetUncertainty(double huber_threshold) : huber_threshold_(huber_threshold) {}
  /// Takes the innovation of a scan that was used and that shows the offset.
  void add(const Innovation& innovation);

  /// Standard deviation of the offset [s], given its marginal variance [s^2].
  double sigma(double variance) const;
  /// Random walk with which the estimate follows the change that the scans show [s/sqrt(s)]; 0 for none.
  double walk() const;

 private:
  double squaredLag() const;  ///< [s^2]

  double huber_threshold_;  // read-only after construction
  Time last_;
  double information_ = 0.0;  ///< sum of J' S^-1 J, fading [1/s^2]
  double spread_ = 0.0;       ///< the same with the squares of the fading weights
  double projection_ = 0.0;   ///< sum of J' S^-1 d, fading [1/s]
};

}  // namespace rio_t
