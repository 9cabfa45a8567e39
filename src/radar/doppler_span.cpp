#include "rio_t/radar/doppler_span.h"

#include <algorithm>
#include <cmath>

#include "rio_t/radar/doppler_grid.h"

namespace rio_t {
namespace {

/// [steps] Rounding and the noise of a direction may move a point by this much. So a point is beyond the
/// Dopplers seen if it exceeds them by more, and it is one span off to within less.
constexpr double kClearly = 1.5;
/// A span is found if so many scans more show it than do not. The points of one scan share its velocity, so
/// they count once. An end of the span is where so many points have been: fewer may be errors of the
/// transmission. So many points beyond it in a short time show that the span is too small.
constexpr std::size_t kEnough = 10;
/// [spans] A step may be finer than the noise; it then counts as this.
constexpr double kFinestStep = 0.05;

/// Keeps the kEnough least values, ascending.
void keepLeast(double value, std::vector<double>& least) {
  if (least.size() == kEnough && value >= least.back()) return;
  least.insert(std::upper_bound(least.begin(), least.end(), value), value);
  if (least.size() > kEnough) least.pop_back();
}

}  // namespace

double DopplerSpan::clearly(double step) const { return kClearly * std::max(step, kFinestStep * possible_); }

bool DopplerSpan::reachesBothEnds(const std::vector<RadarDirection>& points, double step) const {
  const double low = lowest_ + clearly(step), high = highest_ - clearly(step);
  const auto any = [&](const auto& reads) { return std::any_of(points.begin(), points.end(), reads); };
  return any([low](const RadarDirection& p) { return p.doppler < low; }) &&
         any([high](const RadarDirection& p) { return p.doppler > high; });
}

/// Extends the range of Dopplers by the points, or drops a span that is too small.
void DopplerSpan::widen(const std::vector<RadarDirection>& points, double step) {
  const double margin = clearly(step);
  int outside = 0;
  for (const RadarDirection& p : points) {
    if (found_ && (p.doppler < lowest_ - margin || p.doppler > highest_ + margin)) {
      ++outside;
      continue;
    }
    keepLeast(p.doppler, least_);
    keepLeast(-p.doppler, largest_);
  }
  outside_ = std::max(0, outside_ + (outside > 0 ? outside : -1));
  if (outside_ >= static_cast<int>(kEnough)) *this = DopplerSpan(given_);
  if (least_.size() < kEnough) return;
  lowest_ = least_.back();
  highest_ = -largest_.back();
}

void DopplerSpan::learn(const std::vector<RadarDirection>& points, const std::optional<TwoReadings>& before,
                        double step) {
  if (given_ > 0.0) return;
  widen(points, step);
  if (lowest_ > highest_) return;
  possible_ = highest_ - lowest_ + step;
  const double margin = clearly(step);
  // Dopplers without steps fill the span little by little.
  if (possible_ > judged_ + margin) {
    judged_ = possible_;
    scans_ = 0;
    found_ = false;
  }
  if (found_ || !before) return;
  std::size_t beyond = 0;    // points whose Doppler must lie beyond those seen
  std::size_t back = 0;      // of these, the ones that are a span off
  std::size_t as_read = 0;   // points that the scan before explains as they read
  std::size_t wrapping = 0;  // points that the scan before explains if they may have wrapped around
  for (const RadarDirection& p : points) {
    if (std::abs(p.doppler + p.u_R.dot(before->as_read)) < margin) ++as_read;
    const double expected = -p.u_R.dot(before->wrapping);
    const bool fits = std::abs(unwrapped(p.doppler, expected, possible_) - expected) < margin;
    if (fits) ++wrapping;
    if (expected > lowest_ - margin && expected < highest_ + margin) continue;
    ++beyond;
    if (std::abs(std::abs(expected - p.doppler) - possible_) < margin) ++back;
  }
  scans_ = std::max(0, scans_ + (2 * back > beyond && wrapping > as_read ? 1 : -1));
  found_ = scans_ >= static_cast<int>(kEnough);
}

}  // namespace rio_t
