#include "rio_t/radar/doppler_span.h"

#include <algorithm>
#include <cmath>

#include "rio_t/radar/doppler_grid.h"

namespace rio_t {
namespace {

/// [steps] Rounding and the noise of a direction may move a point by this much. A point must lie beyond the
/// Dopplers seen by more, and be a span off to within less.
constexpr double kClearly = 1.5;
/// The number of points that shows a span. Moving objects are off by any amount. It is no chance if most of
/// ten points are off by one amount and the Dopplers span that same amount. As many show that a span is too
/// small: fewer are errors of the transmission.
constexpr std::size_t kEnough = 10;
/// [spans] A step may be finer than the noise; it then counts as this.
constexpr double kFinestStep = 0.05;

}  // namespace

void DopplerSpan::learn(const std::vector<RadarDirection>& points, const Eigen::Vector3d& v_R, double step) {
  if (given_ > 0.0) return;
  for (const RadarDirection& p : points) {
    if (std::abs(p.doppler) >= DopplerGrid::kLargestDoppler) continue;
    if (lowest_ <= p.doppler && p.doppler <= highest_) continue;
    if (found_ > 0.0 && ++outside_ < kEnough) continue;
    lowest_ = std::min(lowest_, p.doppler);
    highest_ = std::max(highest_, p.doppler);
    beyond_ = back_ = outside_ = 0;
    found_ = 0.0;
  }
  const double span = highest_ - lowest_ + step;
  const double clearly = kClearly * std::max(step, kFinestStep * span);
  for (const RadarDirection& p : points) {
    const double expected = -p.u_R.dot(v_R);
    if (expected > lowest_ - clearly && expected < highest_ + clearly) continue;
    ++beyond_;
    if (std::abs(std::abs(expected - p.doppler) - span) < clearly) ++back_;
  }
  if (back_ >= kEnough && 2 * back_ > beyond_) found_ = span;
}

}  // namespace rio_t
