#pragma once

#include <ceres/loss_function.h>
#include <ceres/sized_cost_function.h>

#include <Eigen/Core>
#include <memory>

#include "rio_t/factors/radar_velocity_model.h"

namespace rio_t {

/// One ego-velocity of the radar, as the factor needs it.
struct RadarVelocityMeasurement : RadarScanTime {
  Eigen::Vector3d v_R = Eigen::Vector3d::Zero();             ///< radar velocity, in R [m/s]
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  ///< in R [m^2/s^2]
};

/// The radar's velocity (docs/method.md, eq. 13 and 14): residual R_RI v_I - z, whitened, with v_I by
/// RadarMotionModel. Blocks: motion at `state_time`, biases, t_O, extrinsics.
class RadarVelocityFactor final : public ceres::SizedCostFunction<3, StateBlock::kMotion, StateBlock::kBiases,
                                                                  1, ExtrinsicsBlock::kSize> {
 public:
  RadarVelocityFactor(const RadarVelocityMeasurement& z, Time state_time, const RadarMotionModel& model);
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  Eigen::Vector3d z_R_;  ///< [m/s]
  RadarVelocityModel model_;
  Eigen::Matrix3d whitening_;  ///< W with W'W = covariance^-1
};

/// Huber's loss on the norm of the whitened residual; null, which is no loss, for a threshold of 0.
std::shared_ptr<ceres::LossFunction> huberLoss(double threshold);

}  // namespace rio_t
