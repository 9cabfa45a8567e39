#include "rio_t/radar/doppler_grid.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

namespace rio_t {
namespace {

/// [m/s] Smaller steps are none. Beside a noise of 0.035 m/s their sigma of step / sqrt(12) makes 1.4 %.
constexpr double kLeastStep = 0.02;
/// [m/s] Larger ones are none: it would be 1 ms in which the radar measures a Doppler (at 77 GHz).
constexpr double kLargestStep = 2.0;
/// [m/s] Larger values are marks of a driver, like -999 for "no Doppler".
constexpr double kLargestDoppler = 100.0;
/// [steps] of a value as the driver gives it; it may round to decimals or convert. Values of a radar without
/// steps come so near to a multiple once in 500 times.
constexpr double kRounding = 1e-3;
/// [steps] Where a value is expected no better, being 20 times the one that the step was read off, it is a
/// misfit.
constexpr double kMaxTolerance = 0.02;
/// Share of a value by which the same one may differ, as a float or computed from one.
constexpr double kSame = 1e-6;
/// Values of a batch of 16 that may be misfits: no multiples. If every fiftieth value of a radar is one, one
/// batch in 270 has more, and four in a row never have; if every twentieth is, one in 23, and one in 300 000
/// is the last of four. Of a radar without steps, each value is near a multiple of a wrong step once in 25
/// times at most (kMaxTolerance), and 14 of 16 are once in 10^17 times.
constexpr std::size_t kMaxMisfits = 2;
constexpr int kBatchesWithoutStep = 4;

/// The multiple of the step that a value is; 0: it is a misfit. The step was read off a value of `known_at`
/// steps. So m steps are expected to within the rounding of the value and that of the step, which has grown
/// by m / known_at.
double multipleOf(double step, double known_at, double value) {
  const double steps = value / step;
  const double multiple = std::round(steps);
  const double tolerance = kRounding * (1.0 + multiple / known_at);
  return tolerance <= kMaxTolerance && std::abs(steps - multiple) <= tolerance ? multiple : 0.0;
}

/// A step [m/s] and the multiple that it was read off.
struct Reading {
  double step = 0.0;
  double known_at = 1.0;
};

template <typename Batch>
std::size_t countMisfits(const Batch& values, const Reading& reading) {
  return static_cast<std::size_t>(std::count_if(values.begin(), values.end(), [&](double value) {
    return multipleOf(reading.step, reading.known_at, value) == 0.0;
  }));
}

/// `start` as the values tell it, if it explains them: if all but kMaxMisfits are multiples.
///
/// The values ascend, and each larger multiple tells the step better. Only the first value of a multiple
/// does: a step that followed each would creep through values that lie close together without being the same.
template <typename Batch>
std::optional<Reading> explain(const Batch& ascending, const Reading& start) {
  Reading reading = start;
  std::size_t misfits = 0;
  for (const double value : ascending) {
    const double multiple = multipleOf(reading.step, reading.known_at, value);
    if (multiple == 0.0 && ++misfits > kMaxMisfits) return std::nullopt;
    if (multiple > reading.known_at) reading = {value / multiple, multiple};
  }
  return reading;
}

/// More than kMaxMisfits values are multiples of the step alone, and not of one that is some times as large.
/// A smaller step always explains a few more by chance.
template <typename Batch>
bool isNeeded(const Batch& values, const Reading& reading) {
  const std::size_t misfits = countMisfits(values, reading);
  for (double times = 2.0; times * reading.step < kLargestStep; times += 1.0) {
    const Reading larger{times * reading.step, std::max(1.0, reading.known_at / times)};
    if (countMisfits(values, larger) <= misfits + kMaxMisfits) return false;
  }
  return true;
}

/// The largest step above `least` [m/s] that explains the values and that `base` is a multiple of.
template <typename Batch>
std::optional<Reading> largestStep(const Batch& ascending, const Reading& base, double least) {
  double parts = std::max(1.0, std::ceil(base.step / kLargestStep));
  for (; base.step / parts > least; parts += 1.0) {
    const auto found = explain(ascending, {base.step / parts, base.known_at * parts});
    if (found && isNeeded(ascending, *found)) return found;
  }
  return std::nullopt;
}

/// Most values that lie within `width` of each other, as a share of the value.
template <typename Batch>
std::size_t mostWithin(const Batch& ascending, double width) {
  std::size_t most = 0;
  for (auto first = ascending.begin(); first != ascending.end(); ++first) {
    const auto next = std::upper_bound(first, ascending.end(), *first * (1.0 + width));
    most = std::max(most, static_cast<std::size_t>(next - first));
  }
  return most;
}

}  // namespace

DopplerGrid::DopplerGrid(double given) {
  if (!(given >= 0.0) || !std::isfinite(given))
    throw std::invalid_argument("Doppler grid: the step must be finite and at least 0 m/s");
  step_ = given > 0.0 ? DopplerStep{given < kLeastStep ? 0.0 : given, DopplerStepSource::kGiven}
                      : DopplerStep{kTypicalStep, DopplerStepSource::kUnknown};
}

void DopplerGrid::add(const RadarScan& scan) {
  if (step_.source == DopplerStepSource::kGiven) return;
  for (const RadarPoint& point : scan.points) {
    const double size = std::abs(point.doppler);
    // Zero is a multiple of every step.
    if (!(size > 0.5 * kLeastStep && size < kLargestDoppler)) continue;
    batch_[count_] = size;
    if (++count_ == kBatch) judge();
  }
}

/// The batch is full.
void DopplerGrid::judge() {
  count_ = 0;
  std::sort(batch_.begin(), batch_.end());
  std::optional<Reading> found;
  if (step_.source == DopplerStepSource::kData && step_.value > 0.0) {
    // A step that is known is not read anew: a misfit that comes near to a multiple must not move it.
    if (countMisfits(batch_, {step_.value, known_at_}) <= kMaxMisfits) {
      without_step_ = 0;
      return;
    }
    // Perhaps all values so far were multiples of two steps, or three.
    found = largestStep(batch_, {step_.value, known_at_}, kLeastStep);
  }
  if (!found) {
    // One value alone is a multiple, but nobody knows of how many steps. Half of them wait for another.
    if (mostWithin(batch_, 4.0 * kRounding) + kMaxMisfits >= kBatch) {
      count_ = kBatch / 2;
      return;
    }
    // The smallest values are multiples of few steps. One of the first kMaxMisfits + 1 is no misfit.
    for (std::size_t i = 0; i <= kMaxMisfits; ++i) {
      const double least = found ? found->step : kLeastStep;
      if (const auto larger = largestStep(batch_, {batch_[i], 1.0}, least)) found = larger;
    }
  }
  if (found) {
    without_step_ = 0;
    step_ = {found->step, DopplerStepSource::kData};
    known_at_ = found->known_at;
  } else if (2 * mostWithin(batch_, kSame) < kBatch && ++without_step_ >= kBatchesWithoutStep) {
    // Without steps no value comes again and again, as one step does at rest, among misfits.
    step_ = {0.0, DopplerStepSource::kData};
  }
}

std::string toString(DopplerStepSource source) {
  switch (source) {
    case DopplerStepSource::kUnknown:
      return "unknown";
    case DopplerStepSource::kGiven:
      return "given";
    case DopplerStepSource::kData:
      return "data";
  }
  throw std::invalid_argument("Doppler grid: not a source");
}

}  // namespace rio_t
