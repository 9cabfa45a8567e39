#pragma once

#include "rio_t/core/time.h"
#include "rio_t/sensors/innovation.h"

namespace rio_t {

/// How far the time offset may be off (docs/method.md, eq. 32b): its marginal variance, and the square of the
/// lag, where the scans ask for a change all the time. An estimate lags behind an offset that drifts. Not
/// thread-safe.
class OffsetUncertainty {
 public:
  /// `huber_threshold` on d' S^-1 d, as on the radar factors; 0: no robust loss.
  explicit OffsetUncertainty(double huber_threshold) : huber_threshold_(huber_threshold) {}
  /// Of a scan that was used and tells the offset.
  void add(const Innovation& innovation);
  /// The offset was found to have stepped, and is about to be found anew: it does not lag.
  void offsetStepped();

  /// Of the offset [s], given its marginal variance [s^2].
  double sigma(double variance) const;
  /// Random walk that would follow what the scans ask for [s/sqrt(s)]; 0 where they ask for nothing.
  double walk() const;

 private:
  double squaredLag() const;  ///< [s^2]

  double huber_threshold_;  // read-only after construction
  Time last_;
  double information_ = 0.0;  ///< sum of J' S^-1 J, fading [1/s^2]
  double spread_ = 0.0;       ///< the same with the squares of the weights that fade
  double projection_ = 0.0;   ///< sum of J' S^-1 d, fading [1/s]
};

}  // namespace rio_t
