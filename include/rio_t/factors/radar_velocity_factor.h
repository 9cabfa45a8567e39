#pragma once

#include <ceres/loss_function.h>
#include <ceres/sized_cost_function.h>

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "rio_t/core/time.h"
#include "rio_t/factors/radar_motion.h"
#include "rio_t/factors/state_block.h"
#include "rio_t/radar/extrinsics.h"

namespace rio_t {

/// One ego-velocity of the radar, as the factor needs it.
struct RadarVelocityMeasurement {
  Time stamp;                                                ///< measured at stamp - t_O
  Eigen::Vector3d v_R = Eigen::Vector3d::Zero();             ///< radar velocity, in R [m/s]
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  ///< in R [m^2/s^2]
  Extrinsics T_IR;
  /// Set if the scan does not tell the offset (VelocityRate::informsOffset). The factor then uses this value
  /// [s] instead of t_O. At constant velocity the derivative with respect to t_O is noise of the IMU, and a
  /// thousand such scans would pass for knowledge of the offset.
  std::optional<double> held_t_O = std::nullopt;
};

/// The radar's velocity (docs/method.md, eq. 13 and 14): residual R_RI v_I - z, whitened, with v_I by
/// RadarMotionModel. Blocks: state at `state_time`, t_O.
class RadarVelocityFactor final : public ceres::SizedCostFunction<3, StateBlock::kSize, 1> {
 public:
  RadarVelocityFactor(const RadarVelocityMeasurement& z, Time state_time, const RadarMotionModel& model);
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  RadarVelocityMeasurement z_;
  Time state_time_;
  RadarMotionModel model_;
  Eigen::Matrix3d whitening_;  ///< W with W'W = covariance^-1
  struct Mean {
    Time time;
    ImuMean value;
  };
  mutable std::optional<Mean> mean_;  ///< of the last evaluation: a cache, not for two threads
};

/// Huber's loss on the norm of the whitened residual; null, which is no loss, for a threshold of 0.
std::shared_ptr<ceres::LossFunction> huberLoss(double threshold);

}  // namespace rio_t
