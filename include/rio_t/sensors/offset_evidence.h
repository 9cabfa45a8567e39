#pragma once

#include <Eigen/Core>

#include "rio_t/core/time.h"
#include "rio_t/factors/state_block.h"
#include "rio_t/imu/buffer.h"
#include "rio_t/radar/extrinsics.h"

namespace rio_t {

/// The derivative of the radar's velocity with respect to t_O, as the IMU shows it around a scan.
struct OffsetDerivative {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();    ///< [m/s^2], as the next two: over both sides
  // Over the time before and after the scan. They share no sample, so their noise is independent.
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  Eigen::Vector3d after = Eigen::Vector3d::Zero();
  double variance = 0.0;  ///< of the IMU's noise in `mean`, per axis, as far as it is known [m^2/s^4]
  /// Covariance of the error that all three share: of tilt and accelerometer bias [m^2/s^4].
  Eigen::Matrix3d shared = Eigen::Matrix3d::Zero();

  /// The mean exceeds five sigma of its noise, so it is motion.
  bool isCertain() const;
};

/// The derivative for a state `x` at the time of measurement `tau`, without `shared`. `g_W` is gravity in W
/// [m/s^2].
OffsetDerivative offsetDerivative(const ImuBuffer& imu, Time tau, const StateBlock& x,
                                  const Eigen::Vector3d& g_W, const Extrinsics& T_IR);

/// Tells how much of the derivative with respect to t_O is motion, and how much is noise of the IMU.
///
/// The factor takes noise in the derivative for information about t_O, which no scan has. A derivative far
/// beyond the known noise is motion. For smaller ones, OffsetEvidence compares the time before a scan with
/// the time after it: motion is the same in both, noise is not. So the mean of before' W after is the square
/// of the motion, whatever the noise. The gain is the share of this square in mean' W mean. If the factor
/// shortens the derivative J by the gain, J'J is what the scans know (docs/method.md, section 5.3). Not
/// thread-safe.
class OffsetEvidence {
 public:
  /// `weight`: inverse covariance of the scan's velocity [s^2/m^2].
  void add(Time stamp, const OffsetDerivative& derivative, const Eigen::Matrix3d& weight);
  /// Factor on the derivative, in [0, 1]; 0 while nothing is known.
  double gain() const;

 private:
  Time last_;
  double motion_ = 0.0;           ///< sum of before' W after, less what errors of the state add, fading
  double motion_variance_ = 0.0;  ///< of it
  double all_ = 0.0;              ///< sum of mean' W mean, fading
};

}  // namespace rio_t
