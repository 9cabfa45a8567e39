#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <vector>

#include "rio_t/factors/radar_velocity_factor.h"
#include "rio_t/imu/buffer.h"
#include "rio_t/imu/noise.h"
#include "rio_t/imu/static_initializer.h"
#include "rio_t/odometry/model_error_scale.h"
#include "rio_t/radar/ego_velocity.h"
#include "rio_t/smoother/node_prior.h"
#include "rio_t/smoother/options.h"

namespace rio_t {

struct OdometryOptions;

struct MotionInitializerOptions {
  double window = 2.5;  ///< [s] of radar velocities that are used
  /// [m/s^2] | |g| - gravity | of the linear solution, which does not know the size of gravity. A larger
  /// error means wrong units, extrinsics or signs.
  double max_gravity_error = 2.0;
  double max_outlier_fraction = 0.3;  ///< of the velocities, farther than 4 sigma from the solution
  double sigma_gyro_bias = 0.01;      ///< [rad/s] of b_g around zero before the first scan, per axis
  double sigma_accel_bias = 0.1;      ///< [m/s^2] of b_a around zero, likewise
};

/// The pose that a re-initialisation keeps. At the first start it defines W.
struct PoseAnchor {
  Eigen::Quaterniond q_WI = Eigen::Quaterniond::Identity();  ///< heading is kept, tilt is replaced
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();             ///< [m]
  /// Joint, of the heading [rad] and of p_W [m]. The initializer adds the prior sigmas of the options.
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
};

/// The source of a first state.
enum class InitializedFrom { kRest, kMotion };
std::string toString(InitializedFrom from);  ///< "rest" or "motion"

/// A first state.
struct Initialization {
  Time time;              ///< of the state; in motion, the newest velocity's stamp
  NodePrior prior;        ///< on the state and on the calibration of `radar`, correlations included
  std::size_t radar = 0;  ///< the radar whose velocities were used; the first if `from` rest
  InitializedFrom from = InitializedFrom::kRest;
  ModelErrorScale model_error_scale;  ///< of the velocities around it
};

/// Finds the first state of a moving platform from seconds of radar and IMU (docs/method.md, section 11).
///
/// Let dR, dv integrate the IMU from the state's time to a scan T later (T <= 0), and v_k be the velocity of
/// I, in I, that the scan shows. Then dR v_k - dv = v_I + g_I T: a straight line over T whose slope is the
/// gravity in I. From there a least squares with the factor of the smoother finds roll, pitch, velocity,
/// biases and t_O together. It finds t_O if the motion shows it; if not, the unknown t_O widens the other
/// covariances. The smoother must not use the same scans again. Not thread-safe.
class MotionInitializer {
 public:
  MotionInitializer(const OdometryOptions& options, const CalibrationPrior& radar);

  /// Velocity of one scan, estimated without a prior. Invalid ones are ignored.
  void add(Time stamp, const EgoVelocity& velocity);
  /// The state, as soon as the IMU covers a window of velocities and both agree. If they do not agree, drops
  /// the older half of the window and says why in waitingFor(). `anchor` gives the pose at a time.
  std::optional<Initialization> solve(const ImuBuffer& imu, const std::function<PoseAnchor(Time)>& anchor);
  /// Forgets the velocities.
  void clear();
  void setImuNoise(const ImuNoise& noise) { noise_ = noise; }
  /// Whether the scans stamped within [from, to], by the median of each axis, show a speed above `max_speed`
  /// [m/s]. None without scans.
  std::optional<bool> isMoving(Time from, Time to, double max_speed) const;

  const StartWait& waitingFor() const { return waiting_for_; }
  /// How far back the IMU must reach for solve() [s].
  double imuHistory() const;

 private:
  struct Velocity : RadarVelocityMeasurement {
    Eigen::Vector3d added_variance;  ///< see EgoVelocity
  };
  using Velocities = std::vector<Velocity>;

  /// The velocities of the window that ends with `time`, as far as the IMU covers them without a gap.
  Velocities windowUntil(Time time, const ImuBuffer& imu) const;
  /// Gravity and velocity at `time`, in I, as the line through all velocities; no biases, t_O as configured.
  struct Line {
    Eigen::Vector3d g_I, v_I;
  };
  Line fitLine(const Velocities& velocities, Time time, const ImuBuffer& imu) const;
  /// The state at `time`, or none; then waitingFor() says why.
  std::optional<Initialization> initialize(const Velocities& window, Time time, const ImuBuffer& imu,
                                           const std::function<PoseAnchor(Time)>& anchorAt);
  /// Returns the state of the line. The prior holds heading, position, biases and calibration, and neither
  /// tilt nor velocity.
  NodePrior priorOf(const Line& line, const PoseAnchor& anchor) const;
  /// Improves `prior.x0` and `prior.t_O0`, around which it starts, and adds the information of the
  /// velocities, with model errors of `scale`. Improves `scale` by the scatter of the velocities around the
  /// solution. Returns the share of outliers; none if the velocities do not determine the state.
  std::optional<double> refine(const Velocities& velocities, Time time, const ImuBuffer& imu,
                               ModelErrorScale& scale, NodePrior& prior) const;
  struct OffsetGains {
    std::vector<double> gains;             ///< of OffsetEvidence; 0: the velocity does not inform the offset
    double half_width = kOffsetHalfWidth;  ///< of the mean of the IMU in the derivative [s]
  };
  OffsetGains offsetGains(const Velocities& velocities, Time time, const ImuBuffer& imu, const StateBlock& x,
                          double t_O) const;
  struct CarriedCovariance {
    Eigen::Matrix3d whole;   ///< of a velocity against the state at `time` [m^2/s^2]
    Eigen::Matrix3d scaled;  ///< its part that the model errors scale
  };
  CarriedCovariance carriedCovariance(const Velocity& z, Time time, const ImuBuffer& imu, double scale) const;

  MotionInitializerOptions options_;  // read-only after construction, as the next three
  SmootherOptions smoother_;
  Eigen::Vector3d g_W_;
  CalibrationPrior radar_;
  ImuNoise noise_;

  Velocities velocities_;  // by stamp
  std::optional<Time> tried_at_;
  StartWait waiting_for_{StartObstacle::kTooFewData, "the first radar velocity"};
};

}  // namespace rio_t
