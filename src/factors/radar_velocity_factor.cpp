#include "rio_t/factors/radar_velocity_factor.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "rio_t/core/so3.h"
#include "rio_t/factors/offset_derivative.h"
#include "rio_t/imu/preintegration.h"

namespace rio_t {
namespace {

Eigen::Matrix3d whitening(const Eigen::Matrix3d& covariance) {
  Eigen::Matrix3d W = Eigen::Matrix3d::Identity();
  covariance.llt().matrixL().solveInPlace(W);
  return W;
}

}  // namespace

void ConstantAccelerationRadarFactor::set(const RadarVelocityMeasurement& z, const ImuBuffer& imu,
                                          const Eigen::Vector3d& g_W) {
  z_ = z;
  imu_ = imu.at(z.stamp);
  imu_.acceleration = imu.mean(z.stamp, kOffsetHalfWidth).acceleration;
  g_W_ = g_W;
  whitening_ = whitening(z.covariance);
}

bool ConstantAccelerationRadarFactor::Evaluate(double const* const* parameters, double* residuals,
                                               double** jacobians) const {
  const StateView x(parameters[0]);
  const double t_O = z_.held_t_O.value_or(parameters[1][0]);
  const Eigen::Matrix3d R_IW = x.q_WI.toRotationMatrix().transpose();
  const Eigen::Vector3d v_I = R_IW * x.v_W;
  const Eigen::Vector3d g_I = R_IW * g_W_;
  const Eigen::Vector3d a_c = imu_.acceleration - x.b_a + g_I;
  const Eigen::Vector3d h_I = v_I + (imu_.angular_velocity - x.b_g).cross(z_.l_I) - t_O * a_c;
  Eigen::Map<Eigen::Vector3d>{residuals} = whitening_ * (z_.R_RI * h_I - z_.v_R);
  if (jacobians == nullptr) return true;

  const Eigen::Matrix3d W_R = whitening_ * z_.R_RI;
  if (jacobians[0] != nullptr) {
    Eigen::Map<StateJacobian<3>> J(jacobians[0]);
    J.setZero();
    J.middleCols<3>(StateBlock::kQStored) = W_R * so3::hat(v_I - t_O * g_I);
    J.middleCols<3>(StateBlock::kVStored) = W_R * R_IW;
    J.middleCols<3>(StateBlock::kBgStored) = W_R * so3::hat(z_.l_I);
    J.middleCols<3>(StateBlock::kBaStored) = t_O * W_R;
  }
  if (jacobians[1] != nullptr) {
    Eigen::Map<Eigen::Vector3d> J(jacobians[1]);
    J.setZero();
    if (!z_.held_t_O) J = -W_R * a_c;
  }
  return true;
}

void ImuRadarFactor::set(const RadarVelocityMeasurement& z, Time state_time, const ImuBuffer& imu,
                         double max_time_offset, const Eigen::Vector3d& g_W) {
  z_ = z;
  state_time_ = state_time;
  imu_ = &imu;
  max_time_offset_ = max_time_offset;
  g_W_ = g_W;
  whitening_ = whitening(z.covariance);
}

bool ImuRadarFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const StateView x(parameters[0]);
  const double t_O = std::clamp(z_.held_t_O.value_or(parameters[1][0]), -max_time_offset_, max_time_offset_);
  const Time tau = z_.stamp - t_O;

  ImuDelta delta;
  imu_->forEachInterval(state_time_, tau,
                        [&](double dt, const Eigen::Vector3d& gyro, const Eigen::Vector3d& accel) {
                          delta.step(dt, gyro - x.b_g, accel - x.b_a);
                        });
  const ImuMeasurement at_tau = imu_->at(tau);
  const Eigen::Vector3d omega = at_tau.angular_velocity - x.b_g;

  const Eigen::Matrix3d R_IW = x.q_WI.toRotationMatrix().transpose();  // at the state
  const Eigen::Matrix3d dR_T = delta.dR.toRotationMatrix().transpose();
  const Eigen::Vector3d v_I = R_IW * (x.v_W + delta.dt * g_W_);
  const Eigen::Vector3d v_tau = dR_T * (v_I + delta.dv);  // velocity of I at tau, in I at tau
  Eigen::Map<Eigen::Vector3d>{residuals} = whitening_ * (z_.R_RI * (v_tau + omega.cross(z_.l_I)) - z_.v_R);
  if (jacobians == nullptr) return true;

  const Eigen::Matrix3d W_R = whitening_ * z_.R_RI;
  if (jacobians[0] != nullptr) {
    Eigen::Map<StateJacobian<3>> J(jacobians[0]);
    J.setZero();
    J.middleCols<3>(StateBlock::kQStored) = W_R * dR_T * so3::hat(v_I);
    J.middleCols<3>(StateBlock::kVStored) = W_R * dR_T * R_IW;
    J.middleCols<3>(StateBlock::kBgStored) =
        W_R * (dR_T * delta.dv_dbg + so3::hat(v_tau) * delta.dR_dbg + so3::hat(z_.l_I));
    J.middleCols<3>(StateBlock::kBaStored) = W_R * dR_T * delta.dv_dba;
  }
  if (jacobians[1] != nullptr) {
    Eigen::Map<Eigen::Vector3d> J(jacobians[1]);
    J.setZero();
    if (!z_.held_t_O) {
      J = -W_R *
          velocityRate(imu_->mean(tau, kOffsetHalfWidth), x.b_g, x.b_a, v_tau, dR_T * R_IW * g_W_, z_.l_I)
              .known();
    }
  }
  return true;
}

}  // namespace rio_t
