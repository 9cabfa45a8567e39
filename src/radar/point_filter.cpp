#include "rio_t/radar/point_filter.h"

#include <algorithm>
#include <cmath>

namespace rio_t {

PointVerdict judgePoint(const RadarPoint& point, const EgoVelocityOptions& o) {
  const double range = point.position_R.norm();
  // At range zero there is no direction, whatever min_range says. NaN fails every comparison.
  if (!(range > 0.0) || !std::isfinite(range) || !std::isfinite(point.doppler))
    return PointVerdict::kNoDirection;
  if (range < o.min_range) return PointVerdict::kTooNear;
  if (range > o.max_range) return PointVerdict::kTooFar;
  if (!(point.snr_db >= o.min_snr_db)) return PointVerdict::kTooWeak;
  const Eigen::Vector3d u = point.position_R / range;
  if (std::abs(std::atan2(u.x(), u.y())) > o.max_azimuth) return PointVerdict::kBesideView;
  if (std::abs(std::asin(std::clamp(u.z(), -1.0, 1.0))) > o.max_elevation) return PointVerdict::kAboveView;
  return PointVerdict::kKept;
}

}  // namespace rio_t
