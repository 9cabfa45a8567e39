#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "rio_t/sensors/offset_step_detector.h"
#include "rio_t/smoother/fixed_lag_smoother.h"
#include "rio_t/smoother/options.h"

namespace rio_t {

/// The time offset t_O of a radar, or of all radars if they share it, in the window of the smoother.
///
/// The paper has one t_O per node and a factor that keeps it constant (eq. 8-10). One block whose prior fades
/// by the random walk does the same with fewer unknowns (docs/method.md, section 6.2). After a step of the
/// offset, a new block takes over. Not thread-safe.
class OffsetBlocks {
 public:
  OffsetBlocks(const SmootherOptions& options, const CalibrationPrior& radar);

  /// Adds the first block to a window that starts.
  Block& start(Window& window, double t_O);
  /// Adds a new block for the scans since the step, also for those in the window. It begins at the offset
  /// after the step, and time_offset_sigma links it to the old one. No scan of the window is evaluated later
  /// than `covered`, since the IMU may not reach further.
  void step(FixedLagSmoother& smoother, const OffsetStep& step, Time covered);
  struct OfScan {
    Block* block;
    std::shared_ptr<const double> linear_from;  ///< see RadarScanTime; a step moves it
  };
  OfScan of(Window& window, Time stamp);

  std::size_t steps() const { return steps_; }  ///< so far, of all radars that share t_O
  const Block& newest() const { return *epochs_.back().block; }
  /// t_O [s]; before the start, the value it is configured to begin at.
  double value() const { return epochs_.empty() ? radar_.time_offset_initial : newest().x[0]; }

 private:
  /// Scans from `since` on share one offset.
  struct Epoch {
    Time since;
    std::shared_ptr<Block> block;
  };
  std::shared_ptr<Block> add(Window& window, double t_O) const;

  SmootherOptions options_;  // read-only after construction, as the next two
  CalibrationPrior radar_;
  std::shared_ptr<const Manifold> manifold_;
  std::vector<Epoch> epochs_;  ///< those still in the window
  struct Scan {
    Time stamp;
    std::weak_ptr<double> linear_from;  ///< lives as long as its factor
  };
  std::vector<Scan> scans_;
  std::size_t steps_ = 0;
};

}  // namespace rio_t
