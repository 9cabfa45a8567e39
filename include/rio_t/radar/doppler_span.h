#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "rio_t/radar/scan.h"

namespace rio_t {

/// The Doppler among `doppler` + k `span` that is nearest to `expected` [m/s]. A span of 0 is unlimited.
inline double unwrapped(double doppler, double expected, double span) {
  return span > 0.0 ? doppler + span * std::round((expected - doppler) / span) : doppler;
}

/// The span of a radar's Doppler. A Doppler beyond the span comes back on the other side (aliasing).
///
/// If the span is not given, DopplerSpan reads it off the data. A span shows in two ways: no Doppler is
/// beyond it, and points that must be beyond, by the platform's velocity, are one span off. Not thread-safe.
class DopplerSpan {
 public:
  explicit DopplerSpan(double given) : given_(given) {}  ///< [m/s] 0: read it off the data

  /// Takes the points of a scan whose velocity is known [m/s]. `step` is that of the Doppler [m/s].
  void learn(const std::vector<RadarDirection>& points, const Eigen::Vector3d& v_R, double step);
  /// [m/s] 0: no span is known.
  double value() const { return given_ > 0.0 ? given_ : found_; }

 private:
  double given_;  // read-only after construction
  double found_ = 0.0;
  double lowest_ = std::numeric_limits<double>::infinity();
  double highest_ = -std::numeric_limits<double>::infinity();
  std::size_t beyond_ = 0;   ///< points whose Doppler must lie beyond those seen
  std::size_t back_ = 0;     ///< of these, the ones that are a span off
  std::size_t outside_ = 0;  ///< points that read more than the span that was found
};

}  // namespace rio_t
