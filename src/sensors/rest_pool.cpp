#include "rio_t/sensors/rest_pool.h"

namespace rio_t {

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
