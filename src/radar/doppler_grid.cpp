#include "rio_t/radar/doppler_grid.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <stdexcept>

namespace rio_t {
namespace {

/// [steps] Rounding and conversion by the driver change a value by up to this. A value of a radar without
/// steps is so near to a multiple once in 500 times.
constexpr double kRounding = 1e-3;
/// [steps] The tolerance of a value grows with the value. A value that needs a larger tolerance than this is
/// a misfit. It is 20 times the value that the step was read off.
constexpr double kMaxTolerance = 0.02;
/// Two values that differ by less than this share are the same up to the rounding of floats.
constexpr double kSame = 1e-6;
/// The number of misfits (values that are no multiples) that a batch of 16 may have. If every fiftieth value
/// of a radar is a misfit, one batch in 270 has more, and four in a row never have. If every twentieth is,
/// one batch in 23 has more, and one in 300 000 is the last of four. If a radar has no steps, a value is near
/// a multiple of a wrong step once in 25 times at most (kMaxTolerance), and 14 of 16 once in 10^17 times.
constexpr std::size_t kMaxMisfits = 2;
constexpr int kBatchesWithoutStep = 4;

/// The multiple of the step that a value is; 0 if it is a misfit. The step was read off a value of `known_at`
/// steps. So a value of m steps may be off by its own rounding and by that of the step, which has grown
/// by the factor m / known_at.
double multipleOf(double step, double known_at, double value) {
  const double steps = value / step;
  const double multiple = std::round(steps);
  const double tolerance = kRounding * (1.0 + multiple / known_at);
  return tolerance <= kMaxTolerance && std::abs(steps - multiple) <= tolerance ? multiple : 0.0;
}

using Batch = DopplerGrid::Batch;

/// A step [m/s] and the multiple that it was read off.
struct Reading {
  double step = 0.0;
  double known_at = 1.0;
};

std::size_t countMisfits(const Batch& values, const Reading& reading) {
  return static_cast<std::size_t>(std::count_if(values.begin(), values.end(), [&](double value) {
    return multipleOf(reading.step, reading.known_at, value) == 0.0;
  }));
}

/// The reading `start`, refined by the values; none if more than kMaxMisfits values are no multiples.
///
/// The values ascend, and each larger multiple gives a better step. Only the first value of a multiple
/// counts: a step that followed each would creep through values that lie close together.
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

/// Whether more than kMaxMisfits values are multiples of this step and not of a step 2, 3, ... times as
/// large. A smaller step always explains a few more values by chance.
bool isNeeded(const Batch& values, const Reading& reading) {
  const std::size_t misfits = countMisfits(values, reading);
  for (double times = 2.0; times * reading.step < DopplerGrid::kLargestStep; times += 1.0) {
    const Reading larger{times * reading.step, std::max(1.0, reading.known_at / times)};
    if (countMisfits(values, larger) <= misfits + kMaxMisfits) return false;
  }
  return true;
}

/// The largest step above `least` [m/s] that explains the values and that `base` is a multiple of.
std::optional<Reading> largestStep(const Batch& ascending, const Reading& base, double least) {
  double parts = std::max(1.0, std::ceil(base.step / DopplerGrid::kLargestStep));
  for (; base.step / parts > least; parts += 1.0) {
    const auto found = explain(ascending, {base.step / parts, base.known_at * parts});
    if (found && isNeeded(ascending, *found)) return found;
  }
  return std::nullopt;
}

/// The largest number of values that lie within `width` of each other, a share of the value.
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
  if (given > 0.0) given_ = KnownDoppler{given < kLeastStep ? 0.0 : given, DopplerSource::kGiven};
}

void DopplerGrid::add(const RadarScan& scan) {
  for (const RadarPoint& point : scan.points) {
    const double size = std::abs(point.doppler);
    // Zero is a multiple of every step.
    if (!(size > 0.5 * kLeastStep && size < kLargestDoppler)) continue;
    batch_[count_] = size;
    if (++count_ < kBatch) continue;
    judge();
    // Values without a step take the longest search: one batch a scan is enough.
    if (read_.value == 0.0) return;
  }
}

/// Judges the batch, which is full.
void DopplerGrid::judge() {
  count_ = 0;
  std::sort(batch_.begin(), batch_.end());
  std::optional<Reading> found;
  if (read_.source == DopplerSource::kData && read_.value > 0.0) {
    // The known step stays as it is: a misfit that comes near to a multiple must not move it.
    if (countMisfits(batch_, {read_.value, known_at_}) <= kMaxMisfits) {
      without_step_ = 0;
      return;
    }
    // Perhaps the true step is a half of the known one, or a third, and so on.
    found = largestStep(batch_, {read_.value, known_at_}, kLeastStep);
  }
  if (!found) {
    // If all values are the same, they do not show how many steps the value is. The detector keeps half of
    // the batch and waits for another value. Until then the step is the largest possible one.
    if (mostWithin(batch_, 4.0 * kRounding) + kMaxMisfits >= kBatch) {
      const double value = batch_[kBatch / 2];
      const bool repeats = mostWithin(batch_, kSame) + kMaxMisfits >= kBatch;
      if (read_.source == DopplerSource::kUnknown && repeats && value < kLargestStep) read_.value = value;
      count_ = kBatch / 2;
      return;
    }
    // The smallest values are multiples of few steps. At least one of the first kMaxMisfits + 1 is no misfit.
    for (std::size_t i = 0; i <= kMaxMisfits; ++i) {
      const double least = found ? found->step : kLeastStep;
      if (const auto larger = largestStep(batch_, {batch_[i], 1.0}, least)) found = larger;
    }
  }
  if (found) {
    without_step_ = 0;
    read_ = {found->step, DopplerSource::kData};
    known_at_ = found->known_at;
  } else if (2 * mostWithin(batch_, kSame) < kBatch && ++without_step_ >= kBatchesWithoutStep) {
    // Without steps, no value repeats. At rest, the value of one step repeats, even among misfits.
    read_ = {0.0, DopplerSource::kData};
  }
}

std::string toString(DopplerSource source) {
  constexpr const char* kNames[] = {"unknown", "given", "data"};
  static_assert(std::size(kNames) == static_cast<std::size_t>(DopplerSource::kData) + 1);
  return kNames[static_cast<std::size_t>(source)];
}

}  // namespace rio_t
