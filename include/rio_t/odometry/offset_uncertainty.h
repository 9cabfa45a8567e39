#pragma once

#include <Eigen/Core>

#include "rio_t/core/time.h"
#include "rio_t/odometry/variance_factor.h"

namespace rio_t {

/// How far the time offset may be off, by what the scans say and not only by what the options promise
/// (docs/method.md, section 7): its marginal variance times the variance factor of the innovations, and where
/// they ask for a change, always the same way, the square of that. So lags an estimate behind an offset that
/// drifts. Not thread-safe.
class OffsetUncertainty {
 public:
  /// `huber_threshold` on d' S^-1 d, as on the radar factors; 0: no robust loss.
  explicit OffsetUncertainty(double huber_threshold) : huber_threshold_(huber_threshold) {}
  /// A scan that was used and tells the offset: its innovation `d` [m/s], the covariance S of that, and
  /// `J` = d(velocity)/d(t_O) [m/s^2].
  void add(Time stamp, const Eigen::Vector3d& d, const Eigen::Matrix3d& S, const Eigen::Vector3d& J);
  /// The offset was found to have stepped, and is about to be found anew: it does not lag.
  void offsetStepped();

  /// Of the offset [s], given its marginal variance [s^2].
  double sigma(double variance) const;

 private:
  double huber_threshold_;  // read-only after construction
  Time last_;
  VarianceFactor factor_;     ///< of the last minute
  double information_ = 0.0;  ///< sum of J' S^-1 J, fading [1/s^2]
  double spread_ = 0.0;       ///< the same with the squares of the weights that fade
  double projection_ = 0.0;   ///< sum of J' S^-1 d, fading [1/s]
};

}  // namespace rio_t
