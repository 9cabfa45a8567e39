#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "rio_t/radar/doppler_grid.h"
#include "rio_t/radar/scan.h"

namespace rio_t {

/// The Doppler among `doppler` + k `span` that is nearest to `expected` [m/s]. A span of 0 is unlimited.
inline double unwrapped(double doppler, double expected, double span) {
  return span > 0.0 ? doppler + span * std::round((expected - doppler) / span) : doppler;
}

/// Velocities of a scan by its points alone, in R [m/s].
struct TwoReadings {
  Eigen::Vector3d as_read;   ///< with the Dopplers as they read
  Eigen::Vector3d wrapping;  ///< with Dopplers that may have wrapped around the possible span
};

/// The span of a radar's Doppler. A Doppler beyond the span comes back on the other side (aliasing).
///
/// If the span is not given, DopplerSpan reads it off the data. A span shows in three ways: no Doppler is
/// beyond it; points that must be beyond, by the platform's velocity, are one span off; and the Dopplers fit
/// a velocity better if they may wrap around than as they read. A few Dopplers that are errors of the
/// transmission do not count. Not thread-safe.
class DopplerSpan {
 public:
  explicit DopplerSpan(double given) : given_(given) {}  ///< [m/s] 0: read it off the data

  /// Takes the points of a scan. `before` are the velocities of the scan before it; none: unknown, or at
  /// rest. They must not come from `points`, which would confirm any span that they were fitted with. `step`
  /// is that of the Doppler [m/s].
  void learn(const std::vector<RadarDirection>& points, const std::optional<TwoReadings>& before,
             double step);
  KnownDoppler known() const {
    if (given_ > 0.0) return {given_, DopplerSource::kGiven};
    return found_ ? KnownDoppler{possible_, DopplerSource::kData} : KnownDoppler{};
  }
  double value() const { return known().value; }  ///< [m/s] 0: no span is known
  /// Whether a scan can show the span: some of its points read about the lowest Doppler seen, and some about
  /// the highest. Dopplers that leave the span at one end come back at the other.
  bool reachesBothEnds(const std::vector<RadarDirection>& points, double step) const;
  /// [m/s] The span if there is one: the range of the Dopplers seen. 0 before that is known.
  double possible() const { return given_ > 0.0 ? given_ : possible_; }

 private:
  double clearly(double step) const;  ///< [m/s]
  void widen(const std::vector<RadarDirection>& points, double step);

  double given_;
  std::vector<double> least_, largest_;  // the least Dopplers, and the largest negated; both ascending
  /// The range of the Dopplers, but for a few at either end.
  double lowest_ = std::numeric_limits<double>::infinity();
  double highest_ = -std::numeric_limits<double>::infinity();
  double possible_ = 0.0;
  double judged_ = 0.0;  ///< the span that scans_ is about
  bool found_ = false;
  int scans_ = 0;    ///< recent scans that showed the span, minus those that did not
  int outside_ = 0;  ///< recent points beyond the span that was found
};

}  // namespace rio_t
