#include "rio_t/factors/imu_factor.h"

#include <Eigen/Cholesky>

#include "rio_t/core/so3.h"

namespace rio_t {

ImuFactor::ImuFactor(const Preintegration& preintegration, const Eigen::Vector3d& g_W)
    : pre_(preintegration), g_W_(g_W) {
  // W = L^-1 where L L' is the covariance.
  whitening_.setIdentity();
  pre_.covariance.llt().matrixL().solveInPlace(whitening_);
}

bool ImuFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const StateView i(parameters[0], parameters[2]);
  const MotionView j(parameters[1]);
  const ImuDelta& d = pre_.delta;
  const double T = d.dt;
  const Eigen::Vector3d d_bg = i.b_g - pre_.b_g;
  const Eigen::Vector3d d_ba = i.b_a - pre_.b_a;

  const Eigen::Vector3d dR_correction = d.dR_dbg * d_bg;
  const Eigen::Matrix3d R_i_T = i.q_WI.toRotationMatrix().transpose();
  const Eigen::Vector3d e_R =
      so3::log((d.dR * so3::exp(dR_correction)).conjugate() * i.q_WI.conjugate() * j.q_WI);
  const Eigen::Vector3d p_I = R_i_T * (j.p_W - i.p_W - T * i.v_W - 0.5 * T * T * g_W_);
  const Eigen::Vector3d v_I = R_i_T * (j.v_W - i.v_W - T * g_W_);

  Eigen::Matrix<double, 9, 1> e;
  e << e_R, p_I - (d.dp + d.dp_dbg * d_bg + d.dp_dba * d_ba),
      v_I - (d.dv + d.dv_dbg * d_bg + d.dv_dba * d_ba);
  Eigen::Map<Eigen::Matrix<double, 9, 1>>{residuals}.noalias() =
      whitening_.triangularView<Eigen::Lower>() * e;
  if (jacobians == nullptr) return true;

  using S = StateBlock;
  const Eigen::Matrix3d Jr_inv = so3::rightJacobianInverse(e_R);
  MotionJacobian<9> by_i = MotionJacobian<9>::Zero(), by_j = MotionJacobian<9>::Zero();
  by_i.block<3, 3>(0, S::kQStored) = -Jr_inv * (j.q_WI.conjugate() * i.q_WI).toRotationMatrix();
  by_i.block<3, 3>(3, S::kQStored) = so3::hat(p_I);
  by_i.block<3, 3>(3, S::kPStored) = -R_i_T;
  by_i.block<3, 3>(3, S::kVStored) = -T * R_i_T;
  by_i.block<3, 3>(6, S::kQStored) = so3::hat(v_I);
  by_i.block<3, 3>(6, S::kVStored) = -R_i_T;
  by_j.block<3, 3>(0, S::kQStored) = Jr_inv;
  by_j.block<3, 3>(3, S::kPStored) = R_i_T;
  by_j.block<3, 3>(6, S::kVStored) = R_i_T;
  BiasJacobian<9> by_biases;
  by_biases << -Jr_inv * so3::exp(e_R).toRotationMatrix().transpose() * so3::rightJacobian(dR_correction) *
                   d.dR_dbg,
      Eigen::Matrix3d::Zero(),  //
      -d.dp_dbg, -d.dp_dba,     //
      -d.dv_dbg, -d.dv_dba;
  store(whitening_.lazyProduct(by_i), jacobians[0]);
  store(whitening_.lazyProduct(by_j), jacobians[1]);
  store(whitening_.lazyProduct(by_biases), jacobians[2]);
  return true;
}

ImuTransition transition(const StateBlock& state_i, const Preintegration& preintegration) {
  const ImuDelta& d = preintegration.delta;
  const double T = d.dt;
  const Eigen::Matrix3d R_i = state_i.q_WI().toRotationMatrix();
  using S = StateBlock;
  ImuTransition result;
  result.A.setIdentity();
  result.A.block<3, 3>(S::kTheta, S::kTheta) = d.dR.toRotationMatrix().transpose();
  result.A.block<3, 3>(S::kTheta, S::kBg) = d.dR_dbg;
  result.A.block<3, 3>(S::kP, S::kTheta) = -R_i * so3::hat(d.dp);
  result.A.block<3, 3>(S::kP, S::kV).diagonal().setConstant(T);
  result.A.block<3, 3>(S::kP, S::kBg) = R_i * d.dp_dbg;
  result.A.block<3, 3>(S::kP, S::kBa) = R_i * d.dp_dba;
  result.A.block<3, 3>(S::kV, S::kTheta) = -R_i * so3::hat(d.dv);
  result.A.block<3, 3>(S::kV, S::kBg) = R_i * d.dv_dbg;
  result.A.block<3, 3>(S::kV, S::kBa) = R_i * d.dv_dba;

  Eigen::Matrix<double, 9, 9> turn = Eigen::Matrix<double, 9, 9>::Identity();  // p and v errors stand in I_i
  turn.block<3, 3>(S::kP, S::kP) = R_i;
  turn.block<3, 3>(S::kV, S::kV) = R_i;
  result.Q = turn * preintegration.covariance * turn.transpose();
  return result;
}

StateBlock predict(const StateBlock& state_i, const ImuDelta& delta, const Eigen::Vector3d& g_W) {
  const Eigen::Quaterniond q_WI = state_i.q_WI();
  const double T = delta.dt;
  StateBlock state_j = state_i;
  state_j.q_WI() = (q_WI * delta.dR).normalized();
  state_j.p_W() += T * state_i.v_W() + 0.5 * T * T * g_W + q_WI * delta.dp;
  state_j.v_W() += T * g_W + q_WI * delta.dv;
  return state_j;
}

StateBlock carried(const StateBlock& x, Time from, Time to, const ImuBuffer& imu,
                   const Eigen::Vector3d& g_W) {
  return predict(x, integrate(imu, from, to, x.b_g(), x.b_a()), g_W);
}

}  // namespace rio_t
