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
  if (jacobians[0] != nullptr) Eigen::Map<MotionJacobian<3>>{jacobians[0]} = whitening_ * predicted.J_motion;
  if (jacobians[1] != nullptr) Eigen::Map<BiasJacobian<3>>{jacobians[1]} = whitening_ * predicted.J_biases;
  if (jacobians[2] != nullptr) Eigen::Map<Eigen::Vector3d>{jacobians[2]} = whitening_ * predicted.dv_dt_O;
  if (jacobians[3] != nullptr)
    Eigen::Map<ExtrinsicsJacobian<3>>{jacobians[3]} = whitening_ * predicted.J_extrinsics;
  return true;
}

std::shared_ptr<ceres::LossFunction> huberLoss(double threshold) {
  if (threshold == 0.0) return nullptr;
  return std::make_shared<ceres::HuberLoss>(threshold);
}

}  // namespace rio_t
