#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "rio_t/core/time.h"
#include "rio_t/factors/extrinsics_manifold.h"
#include "rio_t/factors/radar_motion.h"
#include "rio_t/factors/state_block.h"
#include "rio_t/radar/extrinsics.h"

namespace rio_t {

/// Mean motion around a scan, for the derivatives with respect to the mounting (docs/method.md, section 5.8).
///
/// The estimated velocity and the gyro contain noise that changes from scan to scan. In a derivative, this
/// noise would look like motion that shows the mounting, and the factor would claim information from it.
struct SlowMotion {
  Extrinsics T_IR;                                    ///< mounting from which the factor is linear
  Eigen::Vector3d v_R = Eigen::Vector3d::Zero();      ///< velocity of the radar, in R [m/s]
  Eigen::Vector3d omega_I = Eigen::Vector3d::Zero();  ///< angular velocity of I, in I [rad/s]
  double omega_variance = 0.0;                        ///< of its noise, about each axis [rad^2/s^2]
};

/// When a scan was taken.
struct RadarScanTime {
  Time stamp;  ///< measured at stamp - t_O
  /// Factor on the derivative with respect to t_O: the share that is not noise of the IMU (OffsetEvidence).
  double offset_gain = 1.0;
  double offset_half_width = kOffsetHalfWidth;  ///< of the mean in that derivative [s]
  /// SlowMotion averages over this time to either side [s]. It is the longest if the scan shows no motion.
  double slow_half_width = kMaxOffsetHalfWidth;
  /// If set, the motion is linear in t_O about this value [s]. If each t_O integrated the IMU anew, the noise
  /// of the IMU would raise the cost for a shift in either direction. With an offset_gain of 0, the motion
  /// does not depend on t_O. This value and the next may change between two solves, but not during one.
  std::shared_ptr<const double> linear_from_t_O = nullptr;
  /// If set, the velocity is linear in the mounting, with the derivatives that this motion gives.
  std::shared_ptr<const SlowMotion> slow = nullptr;
};

/// Velocity of the radar at the time of measurement of a scan, in R, and its derivatives.
struct PredictedVelocity {
  Eigen::Vector3d v_R;         ///< [m/s]
  MotionJacobian<3> J_motion;  ///< as StateBlock stores it
  BiasJacobian<3> J_biases;
  Eigen::Vector3d dv_dt_O = Eigen::Vector3d::Zero();  ///< zero if offset_gain is 0 [m/s^2]
  ExtrinsicsJacobian<3> J_extrinsics;                 ///< as ExtrinsicsBlock stores it
};

/// RadarMotionModel for the factors of one scan. Not for two threads: it keeps the last mean of the IMU.
class RadarVelocityModel {
 public:
  RadarVelocityModel(const RadarScanTime& scan, Time state_time, const RadarMotionModel& model)
      : scan_(scan), state_time_(state_time), model_(model) {}

  /// `parameters`: motion at `state_time`, biases, t_O, extrinsics. Without `derivatives` only v_R is set.
  PredictedVelocity at(double const* const* parameters, bool derivatives) const;

 private:
  bool isCurrent(Time mean_time) const;

  RadarScanTime scan_;
  Time state_time_;
  RadarMotionModel model_;
  struct Mean {
    Time time;
    Time imu_until;  ///< what the IMU reached then: later samples may belong to the mean
    ImuMean value;
  };
  mutable std::optional<Mean> mean_;  ///< of the last evaluation: a cache
};

}  // namespace rio_t
