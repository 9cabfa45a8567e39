#include "rio_t/radar/point_filter.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <tuple>

namespace rio_t {
namespace {

/// [m] Coordinates in whole millimetres, as some drivers give them, move a range by less than 1 mm. No radar
/// resolves less than 30 mm.
constexpr double kSameRange = 0.005;

}  // namespace

void markAmbiguous(std::vector<RadarPoint>& points) {
  if (points.size() < 2) return;
  struct Echo {
    double snr_db, doppler, range;
    std::size_t index;
  };
  std::vector<Echo> echoes;
  for (std::size_t i = 0; i < points.size(); ++i)
    echoes.push_back({points[i].snr_db, points[i].doppler, points[i].position_R.norm(), i});
  std::sort(echoes.begin(), echoes.end(), [](const Echo& a, const Echo& b) {
    return std::tie(a.snr_db, a.doppler, a.range) < std::tie(b.snr_db, b.doppler, b.range);
  });
  const bool snr_tells = echoes.size() == 2 || echoes.front().snr_db != echoes.back().snr_db;
  if (!snr_tells) return;
  for (std::size_t i = 1; i < echoes.size(); ++i) {
    const Echo& a = echoes[i - 1];
    const Echo& b = echoes[i];
    if (a.snr_db == b.snr_db && a.doppler == b.doppler && b.range - a.range < kSameRange)
      points[a.index].is_ambiguous = points[b.index].is_ambiguous = true;
  }
}

PointVerdict judgePoint(const RadarPoint& point, const EgoVelocityOptions& o) {
  const double range = point.position_R.norm();
  // At range zero there is no direction, whatever min_range says. NaN fails every comparison.
  if (!(range > 0.0) || !std::isfinite(range) || !std::isfinite(point.doppler))
    return PointVerdict::kNoDirection;
  if (range < o.min_range) return PointVerdict::kTooNear;
  if (range > o.max_range) return PointVerdict::kTooFar;
  if (!(point.snr_db >= o.min_snr_db)) return PointVerdict::kTooWeak;
  const Eigen::Vector3d& p = point.position_R;
  if (p.y() < std::cos(o.max_azimuth) * p.head<2>().norm()) return PointVerdict::kBesideView;
  if (std::abs(p.z()) > std::sin(o.max_elevation) * range) return PointVerdict::kAboveView;
  if (point.is_ambiguous) return PointVerdict::kAmbiguous;
  return PointVerdict::kKept;
}

}  // namespace rio_t
