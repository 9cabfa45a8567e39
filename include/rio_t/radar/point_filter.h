#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "rio_t/radar/ego_velocity.h"
#include "rio_t/radar/scan.h"

namespace rio_t {

/// The verdict of the filter of the ego-velocity on a point.
enum class PointVerdict {
  kKept,
  kNoMeasurement,  ///< at range zero, with a Doppler above kLargestDoppler, or not finite
  kTooNear,        ///< below min_range
  kTooFar,         ///< above max_range
  kTooWeak,        ///< below min_snr_db
  kBesideView,     ///< beyond max_azimuth
  kAboveView,      ///< beyond max_elevation, up or down
  kAmbiguous,      ///< has the range, Doppler and SNR of another point
};
constexpr std::size_t kPointVerdicts = 8;

/// Marks the points that have the same range, Doppler and SNR as another. A radar reports one echo at several
/// directions if the spectrum of its angles has more than one peak, and nothing shows which one is right.
/// Marks none if three points or more all have the same SNR: the driver then gives no real SNR.
void markAmbiguous(std::vector<RadarPoint>& points);

/// Judges points by the options of the ego-velocity.
class PointFilter {
 public:
  explicit PointFilter(const EgoVelocityOptions& options);
  /// The first test that the point fails, in the order of PointVerdict.
  PointVerdict judge(const RadarPoint& point) const;

 private:
  double min_range_, max_range_, min_snr_db_;  // read-only after construction, as the next
  double cos_azimuth_, sin_elevation_;         // of the largest angles
};

}  // namespace rio_t
