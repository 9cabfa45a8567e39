#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>

#include "rio_t/radar/scan.h"

namespace rio_t {

/// The source of the step or the span of a Doppler.
enum class DopplerSource {
  kUnknown,  ///< not known yet
  kGiven,    ///< the user gave it
  kData,     ///< read off the data; a step of 0 if the data show none
};
std::string toString(DopplerSource source);  ///< "unknown", "given" or "data"

/// The step or the span of a radar's Doppler, as far as it is known.
struct KnownDoppler {
  /// [m/s] A step: 0 if the Doppler has none, or negligible ones; the largest possible one while it is
  /// unknown. A span: 0 if the data show none.
  double value = 0.0;
  DopplerSource source = DopplerSource::kUnknown;
};

/// Reads the step of a radar's Doppler off the data: all values are multiples of it.
///
/// DopplerGrid judges batches of 16 values that are not zero. It takes the largest step of which at least 14
/// of the 16 values are multiples. Later batches can only divide the step by a whole number, unless the radar
/// is set up anew. After four batches in a row without a step the radar has none. Until the step is known it
/// is the largest that it can be: kLargestUsualStep, or the only value if all are the same (docs/method.md,
/// section 9.7). The answer depends only on the values and their order. Not thread-safe.
class DopplerGrid {
 public:
  /// `given` [m/s] is the step. 0: the data show it; another value below 0.02: the radar has none. Throws
  /// std::invalid_argument if it is negative or not finite.
  explicit DopplerGrid(double given);

  /// Takes all points of a scan, wherever they lie. 45 points take 1 us. If the radar has no steps, `add`
  /// tries all candidates again and again: that takes 9 us at 1 m/s and 70 us at 10 m/s.
  void add(const RadarScan& scan);
  KnownDoppler step() const { return given_.value_or(read_); }
  /// As the data show it, even if another one is given.
  KnownDoppler read() const { return read_; }

  /// [m/s] The step while all values are zero: the largest of the usual steps, 0.03 to 0.5. With a smaller
  /// one, a slow motion would look like certain rest.
  static constexpr double kLargestUsualStep = 0.5;
  /// [m/s] A smaller step counts as none. Its sigma, step / sqrt(12), adds 1.4 % to a noise of 0.035 m/s.
  static constexpr double kLeastStep = 0.02;
  /// [m/s] A larger step counts as none: the radar would measure a Doppler in 1 ms (at 77 GHz).
  static constexpr double kLargestStep = 2.0;

  static constexpr std::size_t kBatch = 16;
  using Batch = std::array<double, kBatch>;

 private:
  void judge();

  std::optional<KnownDoppler> given_;  // read-only after construction
  KnownDoppler read_{kLargestUsualStep, DopplerSource::kUnknown};
  double known_at_ = 1.0;  ///< [steps] value that the step was read off
  Batch batch_ = {};       ///< absolute Dopplers [m/s]
  std::size_t count_ = 0;  ///< of `batch_` that are in use
  int without_step_ = 0;   ///< batches in a row
};

}  // namespace rio_t
