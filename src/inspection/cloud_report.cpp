#include "rio_t/inspection/cloud_report.h"

#include <cmath>

#include "rio_t/core/quantile.h"
#include "rio_t/radar/direction.h"

namespace rio_t {

CloudReport inspectCloud(const std::vector<RadarScan>& scans) {
  CloudReport report;
  std::vector<double> counts, ranges, azimuths, elevations;
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  double behind = 0.0, ambiguous = 0.0, empty = 0.0;
  for (const RadarScan& scan : scans) {
    counts.push_back(static_cast<double>(scan.points.size()));
    if (scan.points.empty()) empty += 1.0;
    for (const RadarPoint& point : scan.points) {
      const Eigen::Vector3d& p = point.position_R;
      const double range = p.norm();
      if (point.doppler != 0.0) report.has_doppler = true;
      if (!(range > 0.0)) continue;
      ranges.push_back(range);
      azimuths.push_back(std::abs(azimuthOf(p)));
      elevations.push_back(std::abs(elevationOf(p)));
      report.mean_direction += p / range;
      squares += (p / range).cwiseAbs2();
      if (p.y() < 0.0) behind += 1.0;
      if (point.is_ambiguous) ambiguous += 1.0;
    }
  }
  report.points = ranges.size();
  if (ranges.empty()) return report;
  const double n = static_cast<double>(ranges.size());
  report.mean_direction /= n;
  report.spread = (squares / n - report.mean_direction.cwiseAbs2()).cwiseMax(0.0).cwiseSqrt();
  report.behind = behind / n;
  report.ambiguous = ambiguous / n;
  report.empty = empty / static_cast<double>(scans.size());
  report.points_10 = quantile(counts, 0.1);
  report.points_50 = quantile(counts, 0.5);
  report.points_90 = quantile(counts, 0.9);
  report.range_99 = quantile(ranges, 0.99);
  report.azimuth_95 = quantile(azimuths, 0.95);
  report.elevation_95 = quantile(elevations, 0.95);
  return report;
}

}  // namespace rio_t
