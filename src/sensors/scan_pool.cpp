#include "rio_t/sensors/scan_pool.h"

namespace rio_t {

RadarScan ScanPool::filled(const RadarScan& scan, const VelocityAt& velocityAt) {
  if (!scans_.empty() && scan.stamp <= scans_.back().stamp)
    scans_.clear();  // late, twice, or a bag that loops
  while (!scans_.empty() && scan.stamp - scans_.front().stamp > kMaxAge) scans_.pop_front();
  RadarScan result = scan;
  const bool is_enough = scan.points.size() >= kEnoughPoints;
  const std::optional<Eigen::Vector3d> v_R = is_enough ? std::nullopt : velocityAt(scan.stamp);
  for (std::size_t i = scans_.size(); v_R && i-- > 0 && result.points.size() < kEnoughPoints;) {
    const std::optional<Eigen::Vector3d> before_R = velocityAt(scans_[i].stamp);
    if (!before_R) break;
    for (RadarPoint point : scans_[i].points) {
      point.doppler -= point.position_R.normalized().dot(*v_R - *before_R);
      result.points.push_back(point);
    }
  }
  scans_.push_back(scan);
  return result;
}

void RestPool::add(const RadarScan& slow) {
  if (!scans_.empty() && slow.stamp <= scans_.back().stamp)
    scans_.clear();                 // late, twice, or a bag that loops
  if (slow.points.empty()) return;  // the pool is bounded by its points
  scans_.push_back(slow);
  std::size_t later = 0;  // points after the oldest scan
  for (std::size_t i = 1; i < scans_.size(); ++i) later += scans_[i].points.size();
  for (; later >= kMost; later -= scans_.front().points.size()) scans_.pop_front();
}

RadarScan RestPool::filled(const RadarScan& scan, std::size_t enough) const {
  RadarScan result = scan;
  for (std::size_t i = scans_.size(); i > 0 && result.points.size() < enough; --i)
    result.points.insert(result.points.end(), scans_[i - 1].points.begin(), scans_[i - 1].points.end());
  return result;
}

}  // namespace rio_t
