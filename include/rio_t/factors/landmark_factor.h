#pragma once

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

#include "rio_t/factors/extrinsics_manifold.h"
#include "rio_t/factors/state_block.h"
#include "rio_t/imu/preintegration.h"

namespace rio_t {

/// Position of a detection with its noise in polar form: along the ray, and across it in the direction of
/// growing azimuth and of growing elevation.
struct PolarMeasurement {
  Eigen::Vector3d position_R = Eigen::Vector3d::Zero();  ///< [m]
  double range_sigma = 0.0;                              ///< [m]
  double azimuth_sigma = 0.0;                            ///< [rad] of the azimuth
  double elevation_sigma = 0.0;                          ///< [rad]
};

/// Whitened residual of a predicted point: range, and the two angles on the plane across the measured ray,
/// each over its sigma. J is the derivative by the point.
struct PolarResidual {
  Eigen::Vector3d value;
  Eigen::Matrix3d J;
};
class PolarNoise {
 public:
  explicit PolarNoise(const PolarMeasurement& z);
  PolarResidual at(const Eigen::Vector3d& predicted_R) const;
  /// Covariance of the measured point, in R [m^2].
  Eigen::Matrix3d covariance() const;

 private:
  double range_;
  Eigen::Matrix3d axes_;    ///< rows: the ray and the two directions across it
  Eigen::Vector3d sigmas_;  ///< [m], [rad], [rad]
};

/// A point of the world as the radar sees it, with the derivatives by motion, mounting and point.
struct SeenPoint {
  Eigen::Vector3d p_R;                 ///< [m]
  MotionJacobian<3> J_motion;          ///< as StateBlock stores it
  ExtrinsicsJacobian<3> J_extrinsics;  ///< as ExtrinsicsBlock stores it
  Eigen::Matrix3d J_point;             ///< by p_W
};
/// `delta` carries the state to the time of measurement.
SeenPoint seenFrom(const MotionView& x, const ImuDelta& delta, const Eigen::Vector3d& g_W,
                   const Extrinsics& T_IR, const Eigen::Vector3d& p_W);

/// A landmark seen in a scan (docs/method.md, section 16). Blocks: motion, extrinsics, landmark.
///
/// The time of measurement is fixed when the scan comes: the offset hardly changes within a window, and a
/// position says less about it than a velocity. So the IMU is integrated once, mostly over less than 5 ms.
class LandmarkFactor final
    : public ceres::SizedCostFunction<3, StateBlock::kMotion, ExtrinsicsBlock::kSize, 3> {
 public:
  LandmarkFactor(const PolarMeasurement& z, const ImuDelta& delta, const Eigen::Vector3d& g_W)
      : noise_(z), delta_(delta), g_W_(g_W) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  PolarNoise noise_;
  ImuDelta delta_;
  Eigen::Vector3d g_W_;
};

}  // namespace rio_t
