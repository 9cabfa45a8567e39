#pragma once

#include <optional>
#include <string>

#include "rio_t/radar/ego_velocity.h"
#include "rio_t/radar/feasibility.h"
#include "rio_t/sensors/innovation_gate.h"
#include "rio_t/sensors/offset_step_detector.h"
#include "rio_t/sensors/offset_uncertainty.h"
#include "rio_t/sensors/radar_in_window.h"
#include "rio_t/smoother/fixed_lag_smoother.h"
#include "rio_t/smoother/options.h"

namespace rio_t {

struct RadarChannelOptions {
  Extrinsics T_IR;
  EgoVelocityOptions ego_velocity;
  FeasibilityOptions feasibility;
  OffsetStepDetectorOptions offset_step_detector;
  SmootherOptions smoother;
  double rest_velocity_sigma = 0.05;  ///< [m/s] of the velocity zero, where the IMU is at rest
};

/// What the estimator knows when a scan comes.
struct ScanContext {
  bool at_rest = false;            ///< the IMU is at rest at the time of measurement
  bool has_diverged = false;       ///< the prediction is not to be trusted
  double model_error_scale = 1.0;  ///< see ModelErrorScale
};

/// What the channel made of a scan.
struct RadarAnswer {
  EgoVelocity ego_velocity;
  std::string rejected_because;  ///< snake case, empty where the scan was used
  bool offset_stepped = false;   ///< t_O was found to have stepped before this scan

  bool was_predicted = false;  ///< else none of what follows
  /// What health judges: the velocity that the scan shows by itself. None where it does not decide.
  std::optional<Innovation> judged;
  /// The same velocity, where most points agree on it and no witness speaks for the prediction: what a new start may be
  /// found from.
  std::optional<EgoVelocity> alone;
  /// Of a used velocity in motion that most points agree on, against a prediction that is linear.
  std::optional<Innovation> used;
  Eigen::Matrix3d prediction_covariance = Eigen::Matrix3d::Zero();  ///< its part in used->S [m^2/s^2]
};

/// One radar, from scan to window: ego-velocity, decisions, time offset. Not thread-safe.
///
/// The decisions in their order (docs/method.md, section 9.3). All judge the innovation of the scan against
/// what IMU and window predict; at rest, against zero.
///
/// | decision | rejects or does | not where |
/// | --- | --- | --- |
/// | prior in RANSAC | picks the points that agree with the prediction, or `ambiguous` | diverged |
/// | feasibility | a jump that no platform makes (paper, II-B1) | - |
/// | step of the offset | gives t_O a new block | no majority; tilt unknown; nothing tells the offset |
/// | gate | what is farther than `innovation_gate` sigma | tilt unknown; silence; all points agree |
/// | health | nothing: counts | no majority, or outvoted by witnesses |
class RadarChannel {
 public:
  /// `imu` must outlive the channel.
  RadarChannel(const RadarChannelOptions& options, const Eigen::Vector3d& g_W, const ImuBuffer& imu);

  /// Velocity of a scan before there is a state.
  EgoVelocity velocityOf(const RadarScan& scan) const { return estimator_.estimate(scan); }
  /// A window starts at `time`; then the first offset is in it.
  void start(FixedLagSmoother& smoother, Time time, const NodePrior& prior);
  /// Decides about a scan and adds it to the window.
  RadarAnswer use(const RadarScan& scan, const ScanContext& context, FixedLagSmoother& smoother);

  Time nodeTime(Time stamp) const { return in_window_.nodeTime(stamp); }
  double offset() const { return in_window_.offset(); }  ///< t_O [s]
  const Block& offsetBlock() const { return in_window_.offsetBlock(); }
  /// [s] given the marginal variance [s^2]; 0 where the offset is not estimated.
  double offsetSigma(double variance) const;
  FixedLagSmoother::RandomWalk offsetWalk() const;
  const PointVariances& noise() const { return estimator_.noise(); }  ///< of the points, as learned so far

 private:
  EgoVelocity measure(const RadarScan& scan, const std::optional<VelocityPrior>& prior, double scale) const;
  Innovation innovation(Time stamp, const VelocityPrior& prior, const EgoVelocity& measured,
                        const std::optional<RadarVelocityPrediction>& prediction) const;
  /// What health and a new start get from the scan.
  void judge(const RadarScan& scan, const VelocityPrior& prior, double scale, RadarAnswer& answer) const;

  RadarChannelOptions options_;  // read-only after construction
  EgoVelocityEstimator estimator_;
  RadarInWindow in_window_;
  FeasibilityCheck feasibility_;
  OffsetStepDetector step_detector_;
  OffsetUncertainty offset_uncertainty_;
  InnovationGate gate_;
};

}  // namespace rio_t
