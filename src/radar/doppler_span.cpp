#include "rio_t/radar/doppler_span.h"

#include <algorithm>

namespace rio_t {
namespace {

/// [steps] A point lies beyond the Dopplers seen, or a span off, by more or less than this: rounding, and the
/// noise of its direction.
constexpr double kClearly = 1.5;
/// So many points make a span. Moving things are off by anything: that most of ten are off by the same
/// amount, which is also where the Dopplers end, is no chance.
constexpr std::size_t kEnough = 10;

}  // namespace

void DopplerSpan::learn(const std::vector<RadarDirection>& points, const Eigen::Vector3d& v_R, double step) {
  if (given_ > 0.0) return;
  for (const RadarDirection& p : points) {
    if (lowest_ <= p.doppler && p.doppler <= highest_) continue;
    lowest_ = std::min(lowest_, p.doppler);
    highest_ = std::max(highest_, p.doppler);
    beyond_ = back_ = 0;
    found_ = 0.0;
  }
  const double span = highest_ - lowest_ + step;
  const double clearly = kClearly * std::max(step, 0.05 * span);
  for (const RadarDirection& p : points) {
    const double expected = -p.u_R.dot(v_R);
    if (expected > lowest_ - clearly && expected < highest_ + clearly) continue;
    ++beyond_;
    if (std::abs(std::abs(expected - p.doppler) - span) < clearly) ++back_;
  }
  if (back_ >= kEnough && 2 * back_ > beyond_) found_ = span;
}

}  // namespace rio_t
