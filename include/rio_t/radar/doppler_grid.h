#pragma once

#include <array>
#include <cstddef>
#include <string>

#include "rio_t/radar/scan.h"

namespace rio_t {

/// Where the Doppler step is from.
enum class DopplerStepSource {
  kUnknown,  ///< not known yet: a typical value
  kGiven,    ///< by the user
  kData,     ///< read off the data; a step of 0 says that they show none
};
std::string toString(DopplerStepSource source);  ///< "unknown", "given" or "data"

struct DopplerStep {
  double value = 0.0;  ///< [m/s]; 0: the Doppler has no steps, or so small ones that they do not matter
  DopplerStepSource source = DopplerStepSource::kUnknown;
};

/// Reads the step of a radar's Doppler off the data: all values are multiples of it.
///
/// Values are judged in batches of 16 that are not zero. The step is the largest one of which all but an
/// eighth of a batch are multiples. Batches that come later can only make it smaller, by a whole number,
/// unless the radar is set up anew. Four batches in a row without a step, and there is none
/// (docs/method.md, section 9.7). The answer depends on the values alone and their order. Not thread-safe.
class DopplerGrid {
 public:
  /// `given` [m/s]: the step, below 0.02 there is none; 0: it is read off the data. Throws
  /// std::invalid_argument if it is negative or not finite.
  explicit DopplerGrid(double given);

  /// Takes all points of a scan, wherever they lie. Of 45 points it takes 1 us; without steps, where all
  /// candidates are tried again and again, 9 us at 1 m/s and 70 us at 10 m/s.
  void add(const RadarScan& scan);
  DopplerStep step() const { return step_; }

  /// [m/s] before the data tell: that of the IWR6843AOP data sets, and in the middle of what is usual (0.03
  /// to 0.5) by ratio.
  static constexpr double kTypicalStep = 0.125;

 private:
  static constexpr std::size_t kBatch = 16;
  using Batch = std::array<double, kBatch>;

  void judge();

  DopplerStep step_;
  double known_at_ = 1.0;  ///< [steps] of the value that it was read off
  Batch batch_ = {};       ///< sizes of Dopplers [m/s]
  std::size_t count_ = 0;  ///< of `batch_` that are in use
  int without_step_ = 0;   ///< batches in a row
};

}  // namespace rio_t
