#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "rio_t/factors/doppler_factor.h"
#include "rio_t/factors/radar_velocity_factor.h"
#include "rio_t/radar/ego_velocity.h"
#include "rio_t/radar/extrinsics.h"
#include "rio_t/sensors/offset_blocks.h"
#include "rio_t/sensors/offset_evidence.h"
#include "rio_t/smoother/fixed_lag_smoother.h"
#include "rio_t/smoother/node_prior.h"
#include "rio_t/smoother/options.h"

namespace rio_t {

/// Predicted velocity of a scan.
struct RadarVelocityPrediction {
  VelocityPrior velocity;   ///< with all uncertainties
  OffsetScan scan;          ///< without `measured`
  double tilt_sigma = 0.0;  ///< of roll and pitch, the larger [rad]
};

/// One radar in the window: its calibration blocks, t_O and extrinsics, and its terms. Not thread-safe.
class RadarInWindow {
 public:
  /// `offset` is shared by the radars that share t_O. `imu` must outlive it.
  RadarInWindow(const SmootherOptions& options, const CalibrationPrior& radar, const Eigen::Vector3d& g_W,
                const ImuBuffer& imu, std::shared_ptr<OffsetBlocks> offset);

  /// Starts `smoother` with the prior on its first state and on the calibration of this radar.
  void start(FixedLagSmoother& smoother, Time time, const NodePrior& prior);
  /// Joins a window that another radar has started, with its calibration as configured.
  void join(FixedLagSmoother& smoother);
  /// Time of a scan's node: its stamp (constant_acceleration), or its estimated time of measurement (imu).
  Time nodeTime(Time stamp) const;
  /// Predicts from the newest node before the scan. None for a scan older than the window.
  std::optional<RadarVelocityPrediction> predict(const FixedLagSmoother& smoother, Time stamp) const;
  /// The velocity alone, in R [m/s].
  std::optional<Eigen::Vector3d> velocityAt(const FixedLagSmoother& smoother, Time stamp) const;
  /// Whether the scan with that stamp has a term already.
  bool has(Time stamp) const {
    return std::any_of(scans_.begin(), scans_.end(), [&](const Scan& scan) { return scan.stamp == stamp; });
  }
  /// Adds the term of a scan that has none; false if the scan is older than the window.
  bool add(FixedLagSmoother& smoother, const RadarVelocityMeasurement& z);
  bool add(FixedLagSmoother& smoother, const DopplerMeasurement& z);
  /// See OffsetBlocks::step.
  void stepOffset(FixedLagSmoother& smoother, const OffsetStep& step, Time covered) {
    offset_->step(smoother, step, covered);
  }
  std::size_t offsetSteps() const { return offset_->steps(); }

  double offset() const { return offset_->value(); }  ///< t_O [s]
  Extrinsics extrinsics() const { return toExtrinsics(extrinsics_->x.data()); }
  /// The blocks that are estimated, for a covariance: t_O, which is always there, and the extrinsics.
  std::vector<const Block*> calibration() const;
  /// For terms on it; constant if it is not estimated.
  Block& extrinsicsBlock() const { return *extrinsics_; }

 private:
  /// Adds the block to a window that starts, and to `estimated` if it is estimated.
  void addExtrinsics(Window& window, const Extrinsics& T_IR, std::vector<Block*>& estimated);
  /// Computes the slow motion of all scans again, with the scans that came after them.
  void updateSlowMotion(const FixedLagSmoother& smoother);
  template <class Factor, class Measurement>
  bool addTerm(FixedLagSmoother& smoother, Measurement z, const std::shared_ptr<ceres::LossFunction>& loss);

  SmootherOptions options_;  // read-only after construction, as the next four
  CalibrationPrior radar_;
  RadarMotionModel model_;
  std::shared_ptr<ceres::LossFunction> loss_;
  std::shared_ptr<const Manifold> extrinsics_manifold_;
  std::shared_ptr<OffsetBlocks> offset_;
  std::shared_ptr<Block> extrinsics_;
  struct Scan {
    Time stamp, node;
    double half_width;                 ///< [s] of the mean in `slow`
    std::shared_ptr<SlowMotion> slow;  ///< that of its factor; null if the mounting is not estimated
  };
  std::vector<Scan> scans_;  ///< in the window
};

}  // namespace rio_t
