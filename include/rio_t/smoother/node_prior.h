#pragma once

#include <Eigen/Core>

#include "rio_t/factors/state_block.h"
#include "rio_t/graph/elimination.h"
#include "rio_t/imu/noise.h"
#include "rio_t/radar/extrinsics.h"
#include "rio_t/smoother/options.h"

namespace rio_t {

/// Sigmas of the extrinsics of a radar as configured, in the tangent of ExtrinsicsManifold [rad, m]. Empty if
/// they are not estimated.
Eigen::VectorXd extrinsicsSigmas(const SmootherOptions& options, const CalibrationPrior& radar);
/// Sigmas of the calibration of a radar as configured: t_O [s], then those of the extrinsics.
Eigen::VectorXd calibrationSigmas(const SmootherOptions& options, const CalibrationPrior& radar);

/// Prior on the first node and on the calibration of a radar.
struct NodePrior {
  StateBlock x0;
  double t_O0 = 0.0;  ///< [s]
  Extrinsics T_IR0;
  SquareRoot root;  ///< of x [-] x0, where x is the state, t_O and, if they are estimated, the extrinsics
};

/// Prior on the first state after `duration` seconds at rest. Yaw and position define W. The mean of the
/// accelerometer is gravity plus b_a, so tilt and b_a are known far better jointly than each by itself
/// (docs/method.md, eq. 7a). `gravity` [m/s^2].
NodePrior priorAtRest(const SmootherOptions& options, const ImuNoise& noise, const StateBlock& x,
                      double gravity, double duration, const CalibrationPrior& radar);

}  // namespace rio_t
