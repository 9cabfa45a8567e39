#pragma once

#include <vector>

#include "rio_t/radar/point_noise.h"

namespace rio_t {

/// The expected true angles of the points of a scan, by linear regression on the measured ones. The expected
/// angle of a point is between its measured angle and the mean of the scan. The expected mean of a scan is
/// between its measured mean and that of earlier scans. The error of an expected angle does not correlate
/// with it (docs/method.md, 5.7).
class AngleRegression {
 public:
  /// `measured` are the angles of the scan [rad], at least one. `noise` is the variance of one [rad^2].
  AngleRegression(const std::vector<double>& measured, double noise, const AngleSpread& spread);
  double expected(double measured) const { return mean_ + share_ * (measured - scan_mean_); }
  double remaining() const { return remaining_; }  ///< variance of the error of `expected` [rad^2]
  /// The mean of the true directions is shorter than the direction at the expected angle, by this factor. It
  /// is exp(-remaining / 2) if the angles spread to both sides alike.
  double shortening(double measured) const;

 private:
  double scan_mean_ = 0.0;
  double mean_ = 0.0;  // expected
  double share_ = 1.0;
  double remaining_ = 0.0;
  double growth_ = 0.0;  // derivative of the squared error of `expected` by the measured angle [rad]
};

}  // namespace rio_t
