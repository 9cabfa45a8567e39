#pragma once

#include <array>
#include <cstddef>
#include <string>

#include "rio_t/radar/ego_velocity.h"
#include "rio_t/radar/scan.h"

namespace rio_t {

/// The verdict of the filter of the ego-velocity on a point.
enum class PointVerdict {
  kKept,
  kNoDirection,  ///< at range zero, or not finite
  kTooNear,      ///< below min_range
  kTooFar,       ///< above max_range
  kTooWeak,      ///< below min_snr_db
  kBesideView,   ///< beyond max_azimuth
  kAboveView,    ///< beyond max_elevation, up or down
};
constexpr std::size_t kPointVerdicts = 7;

/// The first test that the point fails, in the order of PointVerdict.
PointVerdict judgePoint(const RadarPoint& point, const EgoVelocityOptions& options);

}  // namespace rio_t
