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

PointFilter::PointFilter(const EgoVelocityOptions& o)
    : min_range_(o.min_range),
      max_range_(o.max_range),
      min_snr_db_(o.min_snr_db),
      cos_azimuth_(std::cos(o.max_azimuth)),
      sin_elevation_(std::sin(o.max_elevation)) {}

PointVerdict PointFilter::judge(const RadarPoint& point) const {
  const double range = point.position_R.norm();
  // At range zero there is no direction, whatever min_range says. NaN fails every comparison.
  if (!(range > 0.0) || !std::isfinite(range) || !(std::abs(point.doppler) < kLargestDoppler))
    return PointVerdict::kNoMeasurement;
  if (range < min_range_) return PointVerdict::kTooNear;
  if (range > max_range_) return PointVerdict::kTooFar;
  if (!(point.snr_db >= min_snr_db_)) return PointVerdict::kTooWeak;
  const Eigen::Vector3d& p = point.position_R;
  if (p.y() < cos_azimuth_ * p.head<2>().norm()) return PointVerdict::kBesideView;
  if (std::abs(p.z()) > sin_elevation_ * range) return PointVerdict::kAboveView;
  if (point.is_ambiguous) return PointVerdict::kAmbiguous;
  return PointVerdict::kKept;
}

}  // namespace rio_t
