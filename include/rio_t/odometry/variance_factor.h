#pragma once

namespace rio_t {

/// How the radar's velocities scatter against the noise that the options give them: the variance factor
/// (variance of unit weight) of adjustment theory, e.g. Mikhail and Ackermann, Observations and Least
/// Squares, 1976. Those options are a bound on the safe side for one radar and too small for another, and
/// every marginal covariance follows them.
class VarianceFactor {
 public:
  /// A residual or innovation of 3 axes, and its squared length in its own sigmas: 3 on the mean where the
  /// options are right.
  void add(double squared_sigmas);
  /// Forgets all but this share of what was added.
  void fade(double share);
  /// 1 to begin with, and for as long as few were added.
  double value() const;

 private:
  double squares_ = 0.0;  ///< sum of squared_sigmas / 3
  double count_ = 0.0;
};

}  // namespace rio_t
