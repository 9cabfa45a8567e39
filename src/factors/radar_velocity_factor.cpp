#include "rio_t/factors/radar_velocity_factor.h"

#include <Eigen/Cholesky>

namespace rio_t {

RadarVelocityFactor::RadarVelocityFactor(const RadarVelocityMeasurement& z, Time state_time,
                                         const RadarMotionModel& model)
    : z_(z), state_time_(state_time), model_(model), whitening_(Eigen::Matrix3d::Identity()) {
  z.covariance.llt().matrixL().solveInPlace(whitening_);
}

bool RadarVelocityFactor::Evaluate(double const* const* parameters, double* residuals,
                                   double** jacobians) const {
  const double t_O = z_.held_t_O.value_or(parameters[1][0]);
  const Time mean_time = model_.meanTime(z_.stamp, t_O);
  if (jacobians != nullptr && (!mean_ || mean_->time != mean_time))
    mean_ = Mean{mean_time, model_.meanAt(mean_time)};
  const RadarMotion motion = model_.at(parameters[0], state_time_, z_.stamp, t_O, z_.T_IR.l_I,
                                       jacobians != nullptr ? &mean_->value : nullptr);
  const Eigen::Matrix3d W_R = whitening_ * z_.T_IR.R_RI();
  Eigen::Map<Eigen::Vector3d>{residuals} = W_R * motion.v_I - whitening_ * z_.v_R;
  if (jacobians == nullptr) return true;
  if (jacobians[0] != nullptr) Eigen::Map<StateJacobian<3>>{jacobians[0]} = W_R * motion.J_state;
  if (jacobians[1] != nullptr) {
    Eigen::Map<Eigen::Vector3d> J(jacobians[1]);
    J.setZero();
    if (!z_.held_t_O) J = W_R * motion.dv_dt_O;
  }
  return true;
}

std::shared_ptr<ceres::LossFunction> huberLoss(double threshold) {
  if (threshold == 0.0) return nullptr;
  return std::make_shared<ceres::HuberLoss>(threshold);
}

}  // namespace rio_t
