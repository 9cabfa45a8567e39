#include "rio_t/radar/doppler_span.h"

#include <algorithm>
#include <cmath>

#include "rio_t/radar/doppler_grid.h"

namespace rio_t {
namespace {

/// [steps] Rounding and the noise of a direction may move a point by this much. A point must lie beyond the
/// Dopplers seen by more, and be a span off to within less.
constexpr double kClearly = 1.5;
/// The number of scans that shows a span. The points of one scan share its velocity, so they are one witness.
/// It is no chance if ten scans more show the span than do not. As many points show that a span is too small,
/// but not one now and then: that is an error of the transmission.
constexpr int kEnough = 10;
/// [spans] A step may be finer than the noise; it then counts as this.
constexpr double kFinestStep = 0.05;

}  // namespace

double DopplerSpan::clearly(double step) const { return kClearly * std::max(step, kFinestStep * possible_); }

bool DopplerSpan::reachesBothEnds(const std::vector<RadarDirection>& points, double step) const {
  const double low = lowest_ + clearly(step), high = highest_ - clearly(step);
  const auto any = [&](const auto& reads) { return std::any_of(points.begin(), points.end(), reads); };
  return any([low](const RadarDirection& p) { return p.doppler < low; }) &&
         any([high](const RadarDirection& p) { return p.doppler > high; });
}

void DopplerSpan::learn(const std::vector<RadarDirection>& points,
                        const std::optional<Eigen::Vector3d>& expected_v_R, double step) {
  if (given_ > 0.0) return;
  const int outside_before = outside_;
  for (const RadarDirection& p : points) {
    if (lowest_ <= p.doppler && p.doppler <= highest_) continue;
    if (found_ && ++outside_ < kEnough) continue;
    lowest_ = std::min(lowest_, p.doppler);
    highest_ = std::max(highest_, p.doppler);
    outside_ = 0;
  }
  if (outside_ == outside_before) outside_ = std::max(0, outside_ - 1);
  if (lowest_ > highest_) return;
  possible_ = highest_ - lowest_ + step;
  const double margin = clearly(step);
  // Dopplers without steps fill the span little by little.
  if (possible_ > judged_ + margin) {
    judged_ = possible_;
    scans_ = 0;
    found_ = false;
  }
  if (found_ || !expected_v_R) return;
  std::size_t beyond = 0;  // points whose Doppler must lie beyond those seen
  std::size_t back = 0;    // of these, the ones that are a span off
  for (const RadarDirection& p : points) {
    const double expected = -p.u_R.dot(*expected_v_R);
    if (expected > lowest_ - margin && expected < highest_ + margin) continue;
    ++beyond;
    if (std::abs(std::abs(expected - p.doppler) - possible_) < margin) ++back;
  }
  scans_ = std::max(0, scans_ + (2 * back > beyond ? 1 : -1));
  found_ = scans_ >= kEnough;
}

}  // namespace rio_t
