#include "rio_t/sensors/scan_pool.h"

#include <algorithm>

namespace rio_t {
namespace {

/// Some drivers fill their clouds up with points at range zero.
std::size_t seenPoints(const RadarScan& scan) {
  return static_cast<std::size_t>(std::count_if(scan.points.begin(), scan.points.end(),
                                                [](const RadarPoint& p) { return !p.position_R.isZero(); }));
}

}  // namespace

RadarScan ScanPool::filled(const RadarScan& scan, const VelocityAt& velocityAt) {
  if (!scans_.empty() && scan.stamp <= scans_.back().stamp)
    scans_.clear();  // late, twice, or a bag that loops
  while (!scans_.empty() && scan.stamp - scans_.front().stamp > kMaxAge) scans_.pop_front();
  RadarScan result = scan;
  std::size_t seen = seenPoints(scan);
  const std::optional<Eigen::Vector3d> v_R = seen < kEnoughPoints ? velocityAt(scan.stamp) : std::nullopt;
  for (std::size_t i = scans_.size(); v_R && i-- > 0 && seen < kEnoughPoints;) {
    const std::optional<Eigen::Vector3d> before_R = velocityAt(scans_[i].stamp);
    if (!before_R) break;
    for (RadarPoint point : scans_[i].points) {
      if (point.position_R.isZero()) continue;
      point.doppler -= point.position_R.normalized().dot(*v_R - *before_R);
      result.points.push_back(point);
      ++seen;
    }
  }
  scans_.push_back(scan);
  return result;
}

}  // namespace rio_t
