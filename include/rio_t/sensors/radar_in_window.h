#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rio_t/factors/radar_velocity_factor.h"
#include "rio_t/radar/ego_velocity.h"
#include "rio_t/radar/extrinsics.h"
#include "rio_t/smoother/fixed_lag_smoother.h"
#include "rio_t/smoother/node_prior.h"
#include "rio_t/smoother/options.h"

namespace rio_t {

/// What a scan should show.
struct RadarVelocityPrediction {
  VelocityPrior velocity;  ///< with the uncertainty of everything
  Eigen::Matrix3d covariance_at_offset = Eigen::Matrix3d::Zero();  ///< the same, were the offset known [m^2/s^2]
  Eigen::Vector3d dv_dt_O = Eigen::Vector3d::Zero();               ///< of v_R with respect to t_O [m/s^2]
  double t_O = 0.0;                                                ///< at which all this holds [s]
  /// Per axis, of the noise in dv_dt_O times the error of the offset: not in the covariances [m^2/s^2].
  double rate_variance = 0.0;
  bool informs_offset = false;  ///< dv_dt_O is motion, not noise of the IMU
  double tilt_sigma = 0.0;      ///< of roll and pitch, the larger [rad]
};

/// One radar in the window of the smoother: its time offset t_O as a calibration block, and its terms.
///
/// The paper has one t_O a node and a factor that keeps it constant (eq. 8-10). One block the prior of which
/// fades by the random walk says the same with fewer unknowns (docs/method.md, section 6.2). A step of the
/// offset begins a new block. Not thread-safe.
class RadarInWindow {
 public:
  enum class AddResult { kAdded, kOlderThanWindow, kDuplicateStamp };

  /// `imu` must outlive it.
  RadarInWindow(const SmootherOptions& options, const Extrinsics& T_IR, const Eigen::Vector3d& g_W,
                const ImuBuffer& imu);

  /// In a window that starts.
  Block& start(Window& window, double t_O);
  /// Where a scan stamped `stamp` puts its node: the stamp (constant_acceleration), or the time of measurement as now
  /// estimated (imu).
  Time nodeTime(Time stamp) const;
  /// From the newest node before the scan. None for a scan older than the window.
  std::optional<RadarVelocityPrediction> predict(const FixedLagSmoother& smoother, Time stamp) const;
  AddResult add(FixedLagSmoother& smoother, const RadarVelocityMeasurement& z);
  /// The offset stepped before the scan stamped `stamp`: from that scan on t_O is as uncertain as at the start.
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
  std::shared_ptr<Block> addOffset(Window& window, double t_O) const;

  SmootherOptions options_;  // read-only after construction, as the next two
  Extrinsics T_IR_;
  RadarMotionModel model_;
  std::shared_ptr<ceres::LossFunction> loss_;
  std::shared_ptr<const Manifold> manifold_;
  std::vector<Epoch> epochs_;  ///< those that the window still has
  std::vector<Time> stamps_;   ///< of the scans in the window
};

/// Empty for kAdded, else why not, in snake case.
std::string toString(RadarInWindow::AddResult result);

/// Starts `smoother` and `radar` with what is known of their first state and offset.
void start(FixedLagSmoother& smoother, RadarInWindow& radar, Time time, const NodePrior& prior);

}  // namespace rio_t
