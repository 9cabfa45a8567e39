#include "rio_t/factors/radar_velocity_factor.h"

#include <Eigen/Cholesky>

namespace rio_t {

RadarVelocityFactor::RadarVelocityFactor(const RadarVelocityMeasurement& z, Time state_time,
                                         const RadarMotionModel& model)
    : z_R_(z.v_R), model_(z, state_time, model), whitening_(Eigen::Matrix3d::Identity()) {
  z.covariance.llt().matrixL().solveInPlace(whitening_);
}

bool RadarVelocityFactor::Evaluate(double const* const* parameters, double* residuals,
                                   double** jacobians) const {
  const PredictedVelocity predicted = model_.at(parameters, jacobians != nullptr);
  Eigen::Map<Eigen::Vector3d>{residuals} = whitening_ * (predicted.v_R - z_R_);
  if (jacobians == nullptr) return true;
  store(whitening_ * predicted.J_motion, jacobians[0]);
  store(whitening_ * predicted.J_biases, jacobians[1]);
  store(whitening_ * predicted.dv_dt_O, jacobians[2]);
  store(whitening_ * predicted.J_extrinsics, jacobians[3]);
  return true;
}

std::shared_ptr<ceres::LossFunction> huberLoss(double threshold) {
  if (threshold == 0.0) return nullptr;
  return std::make_shared<ceres::HuberLoss>(threshold);
}

}  // namespace rio_t
