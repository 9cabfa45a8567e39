#pragma once

#include <Eigen/Geometry>
#include <array>
#include <deque>

#include "rio_t/core/time.h"
#include "rio_t/factors/radar_motion.h"
#include "rio_t/factors/state_block.h"
#include "rio_t/imu/buffer.h"
#include "rio_t/radar/extrinsics.h"

namespace rio_t {

/// The derivative of the radar's velocity with respect to t_O, as the IMU shows it around a scan.
struct OffsetDerivative {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();  ///< [m/s^2], as the next two: over both sides
  // Over the time before and after the scan. They share no sample, so their noise is independent.
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  Eigen::Vector3d after = Eigen::Vector3d::Zero();
  double half_width = kOffsetHalfWidth;  ///< of `mean` [s]
  double variance = 0.0;  ///< of the IMU's noise in `mean`, per axis, as far as it is known [m^2/s^4]
  Eigen::Vector3d omega_I =
      Eigen::Vector3d::Zero();  ///< angular velocity of I, in I, over the same time [rad/s]
  double omega_variance = 0.0;  ///< of its noise, about each axis [rad^2/s^2]

  /// Whether the mean exceeds five sigma of its noise, so that it is surely motion.
  bool isCertain() const;
};

/// The derivative for a state `x` at the time of measurement `tau`, with a mean over `half_width` [s] to
/// either side, as far as the samples reach. `g_W` is gravity in W [m/s^2].
OffsetDerivative offsetDerivative(const ImuBuffer& imu, Time tau, const StateBlock& x,
                                  const Eigen::Vector3d& g_W, const Extrinsics& T_IR, double half_width);

/// A scan against its prediction.
struct OffsetScan {
  Time tau;      ///< of measurement, as predicted
  StateBlock x;  ///< predicted at tau
  Extrinsics T_IR;
  /// Covariance in R of the error that tilt and accelerometer bias add to every derivative [m^2/s^4].
  Eigen::Matrix3d shared = Eigen::Matrix3d::Zero();
  /// Covariance in R of the predicted velocity if t_O were known [m^2/s^2]. Zero: the prediction does not
  /// follow the scans.
  Eigen::Matrix3d predicted = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d measured = Eigen::Matrix3d::Zero();  ///< covariance in R of the scan's velocity [m^2/s^2]

  Eigen::Matrix3d R_WR() const;
  /// The share of the innovation by which the scan corrects the estimated velocity, in R.
  Eigen::Matrix3d share() const;
  /// If the offset is wrong by one second, this changes the scan's velocity by `J` [m/s^2], in R, and the
  /// scans before have moved the estimated one by `followed` [m/s^2], in W. Returns the difference, and adds
  /// to `followed` what this scan moves (Friedland; see CalibrationCheck).
  Eigen::Vector3d follow(const Eigen::Vector3d& J, Eigen::Vector3d& followed) const;
};

/// Finds how much of the derivative with respect to t_O is motion, and how much is noise of the IMU. In a
/// factor, noise in the derivative would look like information about t_O.
///
/// If the offset is wrong, the estimated velocity follows the radar. So a scan shows the offset only by the
/// change of the derivative since the scans before, and noise changes faster than motion. All sums are over
/// these changes. If a derivative is far beyond its known noise, OffsetEvidence subtracts the noise of the
/// change. For smaller ones, it compares the time before a scan with the time after it: motion is the same in
/// both, noise is independent. So the mean of before' W after is the square of the motion, whatever the
/// noise. The gain is the share of this square in mean' W mean. If the gain multiplies the derivative J, J'J
/// is the information that the scans really have (docs/method.md, section 5.3). Not thread-safe.
class OffsetEvidence {
 public:
  void add(const OffsetScan& scan, const OffsetDerivative& derivative);
  /// Factor on the derivative, in [0, 1]; 0 while nothing is known.
  double gain() const;
  /// Returns the information about the offset that the last scans give [1/s^2].
  double information() const { return gain() * gain() * all_; }

 private:
  struct Followed {
    Time tau;
    double weight = 0.0;  ///< of its mean in mean_
    double sigma = 0.0;   ///< of the noise in its mean [m/s^2]
  };
  /// Returns the variance of the noise in the change of the derivative [m^2/s^4]. The velocity then follows
  /// `share` of the change.
  double varianceOfChange(Time tau, const OffsetDerivative& derivative, double share);

  // If the offset is wrong by one second, the scans have moved the estimated velocity by this, in W [m/s^2]:
  // by the derivative over both sides, and over each side.
  Eigen::Vector3d mean_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d before_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d after_ = Eigen::Vector3d::Zero();
  double constant_ = 0.0;       ///< share of a constant error that the estimated velocity has followed
  double noise_ = 0.0;          ///< variance of the noise in mean_ [m^2/s^4]
  std::deque<Followed> scans_;  ///< scans whose means overlap the newest one
  Time last_;
  double motion_ = 0.0;           ///< sum of before' W after, minus what errors of the state add, fading
  double motion_variance_ = 0.0;  ///< of motion_
  double all_ = 0.0;              ///< sum of mean' W mean, fading
};

/// Evidence for each of kOffsetHalfWidths. The width with the most information is the best: a wide mean has
/// less noise, and smooths fast motion away. Not thread-safe.
class OffsetWidths {
 public:
  /// `imu` must outlive it. `g_W` is gravity in W [m/s^2].
  OffsetWidths(const ImuBuffer& imu, const Eigen::Vector3d& g_W) : imu_(&imu), g_W_(g_W) {}
  /// Each scan counts once a later scan shows that the IMU covers the mean around it.
  void add(const OffsetScan& scan);
  void clear() { widths_ = {}; }
  /// The derivative over the best width, as far as the samples reach.
  OffsetDerivative derivative(const OffsetScan& scan) const;
  double gain() const { return widths_[best()].evidence.gain(); }

 private:
  std::size_t best() const;

  const ImuBuffer* imu_;
  Eigen::Vector3d g_W_;
  struct Width {
    OffsetEvidence evidence;
    std::deque<OffsetScan> waiting;
  };
  std::array<Width, kOffsetHalfWidths.size()> widths_;
};

}  // namespace rio_t
