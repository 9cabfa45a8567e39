#pragma once

#include <optional>
#include <string>

#include "rio_t/imu/rest_detector.h"
#include "rio_t/radar/ego_velocity.h"
#include "rio_t/sensors/innovation_gate.h"
#include "rio_t/sensors/offset_step_detector.h"
#include "rio_t/sensors/offset_uncertainty.h"
#include "rio_t/sensors/radar_in_window.h"
#include "rio_t/sensors/scan_pool.h"
#include "rio_t/smoother/fixed_lag_smoother.h"
#include "rio_t/smoother/options.h"

namespace rio_t {

/// The options of one radar.
struct RadarOptions : CalibrationPrior {
  EgoVelocityOptions ego_velocity;
};

struct RadarChannelOptions {
  RadarOptions radar;
  InnovationGateOptions gate;
  OffsetStepDetectorOptions offset_step_detector;
  SmootherOptions smoother;
};

/// Knowledge of the estimator when a scan comes.
struct ScanContext {
  std::optional<Rest> rest;        ///< as the IMU shows it at the time of measurement
  bool has_diverged = false;       ///< then RANSAC gets no prior
  bool is_contradicted = false;    ///< see HealthMonitor; then no velocity is computed around the prediction
  double model_error_scale = 1.0;  ///< see ModelErrorScale
  Time last_used;                  ///< stamp of the last scan that any radar gave to the window
};

/// The part of a channel's answer to a scan that ScanResult repeats.
struct ScanAnswer {
  EgoVelocity ego_velocity;
  /// Health judges this innovation. None if no majority of the points agrees on a velocity without the
  /// prediction.
  std::optional<Innovation> innovation;
  std::optional<DopplerMeasurement> doppler;  ///< its points, if they and not the velocity count
  std::string rejected_because;               ///< snake case, empty if used; keys of `scans_rejected`
  bool at_rest = false;                       ///< the IMU shows rest, and the points do not deny it
  std::optional<OffsetStep> offset_stepped;   ///< shown by the scans so far
  RadarScanTime taken{Time(), 0.0};           ///< with a gain of 0, the scan does not inform the offset
  double offset_information = 0.0;            ///< of the scan about the offset, if used [1/s^2]
};

/// The innovation of a scan that went into the window.
struct UsedInnovation : Innovation {
  Eigen::Vector3d v_R = Eigen::Vector3d::Zero();        ///< measured [m/s]
  Eigen::Matrix3d predicted = Eigen::Matrix3d::Zero();  ///< part of the prediction in S [m^2/s^2]
  Eigen::Matrix3d R_WR = Eigen::Matrix3d::Identity();   ///< as predicted
  Eigen::Vector3d omega_R = Eigen::Vector3d::Zero();    ///< mean angular velocity, in R [rad/s]
  double omega_variance = 0.0;                          ///< of its noise, about each axis [rad^2/s^2]
};

/// The channel's answer to a scan. All reports about the scan are made from this value.
struct RadarAnswer : ScanAnswer {
  bool was_predicted = false;  ///< if not, neither `innovation` nor what follows is set
  /// The velocity behind `innovation`, for a re-initialisation. Its sigmas are without model_error_scale.
  /// None if its inliers are no majority, if the prediction explains other points that are no chance, or if
  /// it has points of the last such velocity.
  std::optional<EgoVelocity> alone;
  /// Set if the scan was used, the radar moves, most points agree on its velocity, and the prediction is
  /// linear.
  std::optional<UsedInnovation> used;
};

/// One radar, from scan to window: ego-velocity, decisions, time offset. Not thread-safe.
///
/// docs/method.md, section 7.2, has the decisions in their order. All use the innovation of the scan against
/// the prediction of IMU and window; at rest, against zero.
class RadarChannel {
 public:
  /// `imu` must outlive the channel. `offset` is null if the radars do not share t_O.
  RadarChannel(const RadarChannelOptions& options, const Eigen::Vector3d& g_W, const ImuBuffer& imu,
               std::shared_ptr<OffsetBlocks> offset);

  /// Learns about the radar. Call it once per scan, first of all. False: the scan repeats the last one.
  bool observe(const RadarScan& scan) { return estimator_.observe(scan); }
  /// Velocity of a scan from its points alone, for the time before there is a state.
  EgoVelocity velocityOf(const RadarScan& scan) const { return estimator_.estimate(scan); }
  /// Starts a window at `time` with the first node and the calibration of this radar.
  void start(FixedLagSmoother& smoother, Time time, const NodePrior& prior);
  /// Joins a window that another radar has started.
  void join(FixedLagSmoother& smoother);
  /// Decides about a scan and, if it is used, adds its term to the window.
  RadarAnswer use(const RadarScan& scan, const ScanContext& context, FixedLagSmoother& smoother);

  void setGate(const InnovationGateOptions& gate) { options_.gate = gate; }  ///< for the scans to come

  Time nodeTime(Time stamp) const { return in_window_.nodeTime(stamp); }
  double offset() const { return in_window_.offset(); }  ///< t_O [s]
  Extrinsics extrinsics() const { return in_window_.extrinsics(); }
  const Extrinsics& configuredExtrinsics() const { return options_.radar.T_IR; }
  /// The blocks that are estimated: t_O, which is always there, and the extrinsics.
  std::vector<const Block*> calibration() const { return in_window_.calibration(); }
  Block& extrinsicsBlock() const { return in_window_.extrinsicsBlock(); }  ///< for terms on it
  /// [s] given the marginal variance [s^2]; 0 if the offset is not estimated.
  double offsetSigma(double variance) const;
  /// One for each block of calibration().
  std::vector<FixedLagSmoother::RandomWalk> randomWalks() const;
  RadarKnowledge knowledge() const { return estimator_.knowledge(); }

 private:
  /// Forgets what an earlier window has shown.
  void forget();
  /// Starts the step detector and the lag of the offset anew.
  void forgetOffset();
  /// Calls forgetOffset if the offset stepped. Another radar that shares it may have seen the step.
  void followOffsetSteps();
  /// A scan with its prediction and its velocity, before the decisions.
  struct Seen {
    std::optional<RadarVelocityPrediction> prediction;
    std::optional<VelocityPrior> prior;  ///< the prediction; at rest, zero
    RadarScan pooled;                    ///< with the points borrowed, see ScanPool and RestPool
    bool has_borrowed = false;
    Time borrowed_since;  ///< no borrowed point is older
    EgoVelocity velocity;
    bool is_own = false;  ///< the points agree on it; if not, it is `around` the prediction
    bool moves = false;
    OffsetDerivative dv_dt_O;  ///< if it moves, of the predicted velocity with respect to t_O
    bool tilt_is_known = false;
    /// A minority that agrees with the prediction has more noise than its covariance says.
    bool canBeJudged() const { return moves && tilt_is_known && hasMajority(velocity); }
  };
  struct Innovations {
    std::optional<Innovation> all;  ///< of all points, also the borrowed ones
    std::optional<Innovation> own;  ///< of the scan's own points, if they inform the offset
  };
  /// Also sets velocity, rest and the members for health in the answer.
  Seen see(const RadarScan& scan, const ScanContext& context, const FixedLagSmoother& smoother,
           RadarAnswer& answer);
  /// Whether the points confirm a rest that the IMU shows. If many scans together show a creep, `seen`
  /// borrows their points.
  bool confirmsRest(const Rest& rest, const RadarScan& scan, double scale, Seen& seen);
  /// See OffsetEvidence; 0: the scan does not inform the offset. Sets `seen.dv_dt_O`.
  double offsetGain(Seen& seen);
  /// Sets the members of the answer about the offset.
  void informOffset(Seen& seen, RadarAnswer& answer);
  /// Makes the term of the scan's own points. None if no point is of the static world.
  std::optional<DopplerMeasurement> dopplerOf(const RadarScan& scan, const Seen& seen,
                                              const RadarAnswer& answer) const;
  /// Computes Innovations::own of a scan that informs the offset. None if it cannot be judged.
  std::optional<Innovation> ownInnovation(const RadarScan& scan, const Seen& seen) const;
  /// Learns the lag of the offset and the noise of the points from a scan that was used.
  void learn(const RadarScan& scan, const Seen& seen, const Innovations& d, RadarAnswer& answer);
  /// The part of the scan for the window: its own inliers, and the velocity at which their likelihood begins.
  EgoVelocity staticWorld(const RadarScan& scan, const Seen& seen) const;
  bool isTightlyCoupled() const { return options_.smoother.radar_factor == RadarFactor::kDoppler; }
  /// Whether a scan has borrowed points that the scan at `before` had, too.
  static bool sharesPoints(const Seen& seen, const std::optional<Time>& before);
  EgoVelocity measure(const RadarScan& scan, const std::optional<VelocityPrior>& prior, double scale) const;
  /// The velocity that the inliers among the scan's own points show around the prediction. Directions that
  /// they do not see have a large sigma.
  EgoVelocity around(const VelocityPrior& prior, const RadarScan& scan, EgoVelocity result) const;
  /// If `seen` is null, S_at_offset and the changes with t_O are not set.
  Innovation innovation(Time stamp, const VelocityPrior& prior, const EgoVelocity& measured,
                        const Seen* seen) const;
  /// Sets RadarAnswer::innovation and RadarAnswer::alone. `had_prior`: RANSAC used a prior for the velocity.
  void judge(const RadarScan& scan, const VelocityPrior& prior, bool had_prior, double scale,
             RadarAnswer& answer) const;

  RadarChannelOptions options_;  // changed by setGate() alone
  EgoVelocityEstimator estimator_;
  RadarInWindow in_window_;
  /// State that a new window clears.
  struct Memory {
    ScanPool pool;
    RestPool rest_pool;
    std::optional<Time> judged_at;             ///< the last scan, used or not
    std::optional<Time> learned_at, alone_at;  ///< scans that used their points: a borrowed one counts once
    InnovationGate gate;
  };
  Memory memory_;
  OffsetWidths offset_widths_;
  OffsetStepDetector step_detector_;
  OffsetUncertainty offset_uncertainty_;
  std::size_t offset_steps_ = 0;  ///< steps that the two members above know of
};

}  // namespace rio_t
