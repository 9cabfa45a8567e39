#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rio_t/factors/doppler_factor.h"
#include "rio_t/factors/radar_velocity_factor.h"
#include "rio_t/radar/ego_velocity.h"
#include "rio_t/radar/extrinsics.h"
#include "rio_t/sensors/offset_evidence.h"
#include "rio_t/smoother/fixed_lag_smoother.h"
#include "rio_t/smoother/node_prior.h"
#include "rio_t/smoother/options.h"

namespace rio_t {

/// Predicted velocity of a scan.
struct RadarVelocityPrediction {
  VelocityPrior velocity;                                          ///< with all uncertainties
  Eigen::Matrix3d covariance_at_offset = Eigen::Matrix3d::Zero();  ///< if the offset were known [m^2/s^2]
  OffsetDerivative dv_dt_O;                                        ///< of v_R with respect to t_O
  double t_O = 0.0;                                                ///< of the prediction [s]
  /// Per axis: the noise in dv_dt_O times the error of the offset. The covariances do not include it
  /// [m^2/s^2].
  double rate_variance = 0.0;
  double tilt_sigma = 0.0;  ///< of roll and pitch, the larger [rad]
};

/// One radar in the window of the smoother: its time offset t_O as a calibration block, and its terms.
///
/// The paper has one t_O per node and a factor that keeps it constant (eq. 8-10). One block whose prior fades
/// by the random walk says the same with fewer unknowns (docs/method.md, section 6.2). After a step of the
/// offset, a new block takes over. Not thread-safe.
class RadarInWindow {
 public:
  enum class AddResult { kAdded, kOlderThanWindow, kDuplicateStamp };

  /// `imu` must outlive it.
  RadarInWindow(const SmootherOptions& options, const Extrinsics& T_IR, const Eigen::Vector3d& g_W,
                const ImuBuffer& imu);

  /// Adds the first offset block to a window that starts.
  Block& start(Window& window, double t_O);
  /// Time of the node of a scan: its stamp (constant_acceleration), or its time of measurement as now
  /// estimated (imu).
  Time nodeTime(Time stamp) const;
  /// Predicts from the newest node before the scan. None for a scan older than the window.
  std::optional<RadarVelocityPrediction> predict(const FixedLagSmoother& smoother, Time stamp) const;
  /// The velocity alone, in R [m/s].
  std::optional<Eigen::Vector3d> velocityAt(const FixedLagSmoother& smoother, Time stamp) const;
  AddResult add(FixedLagSmoother& smoother, const RadarVelocityMeasurement& z);
  AddResult add(FixedLagSmoother& smoother, const DopplerMeasurement& z);
  /// The offset stepped before the scan stamped `stamp`. That scan and later ones use a new block, which
  /// time_offset_sigma links to the old one.
  void stepOffset(FixedLagSmoother& smoother, Time stamp);

  const Extrinsics& extrinsics() const { return T_IR_; }
  const Block& offsetBlock() const { return *epochs_.back().block; }
  double offset() const { return offsetBlock().x[0]; }  ///< t_O [s]

 private:
  /// Scans from `since` on share one offset.
  struct Epoch {
    Time since;
    std::shared_ptr<Block> block;
  };
  Block& offsetOf(Window& window, Time stamp);
  template <class Factor, class Measurement>
  AddResult addTerm(FixedLagSmoother& smoother, const Measurement& z,
                    const std::shared_ptr<ceres::LossFunction>& loss);
  std::shared_ptr<Block> addOffset(Window& window, double t_O) const;

  SmootherOptions options_;  // read-only after construction, as the next two
  Extrinsics T_IR_;
  RadarMotionModel model_;
  std::shared_ptr<ceres::LossFunction> loss_;
  std::shared_ptr<const Manifold> manifold_;
  std::vector<Epoch> epochs_;  ///< those still in the window
  std::vector<Time> stamps_;   ///< of the scans in the window
};

/// Empty for kAdded, else the reason in snake case.
std::string toString(RadarInWindow::AddResult result);

/// Starts `smoother` and `radar` with the prior on their first state and offset.
void start(FixedLagSmoother& smoother, RadarInWindow& radar, Time time, const NodePrior& prior);

}  // namespace rio_t
