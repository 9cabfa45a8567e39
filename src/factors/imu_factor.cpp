#include "rio_t/factors/imu_factor.h"

#include <Eigen/Cholesky>

#include "rio_t/core/so3.h"

namespace rio_t {
namespace {

using NineRows = Eigen::Matrix<double, 9, StateBlock::kSize, Eigen::RowMajor>;

/// L E for the lower triangle L, by rows: at this size Eigen's triangular product costs several times as
/// much.
NineRows lowerTimes(const Eigen::Matrix<double, 9, 9>& L, const NineRows& E) {
  NineRows result;
  for (int i = 0; i < 9; ++i) {
    result.row(i) = L(i, 0) * E.row(0);
    for (int j = 1; j <= i; ++j) result.row(i) += L(i, j) * E.row(j);
  }
  return result;
}

}  // namespace

ImuFactor::ImuFactor(const Preintegration& preintegration, const ImuNoise& noise, const Eigen::Vector3d& g_W)
    : pre_(preintegration), g_W_(g_W) {
  // W = L^-1 where L L' is the covariance.
  whitening_.setIdentity();
  pre_.covariance.llt().matrixL().solveInPlace(whitening_);
  const double root_dt = std::sqrt(pre_.delta.dt);
  gyro_walk_weight_ = 1.0 / (noise.gyro_random_walk * root_dt);
  accel_walk_weight_ = 1.0 / (noise.accel_random_walk * root_dt);
}

bool ImuFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const StateView i(parameters[0]);
  const StateView j(parameters[1]);
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
  Eigen::Map<Eigen::Matrix<double, 15, 1>> r(residuals);
  r.head<9>().noalias() = whitening_.triangularView<Eigen::Lower>() * e;
  r.segment<3>(9) = gyro_walk_weight_ * (j.b_g - i.b_g);
  r.segment<3>(12) = accel_walk_weight_ * (j.b_a - i.b_a);
  if (jacobians == nullptr) return true;

  using S = StateBlock;
  const Eigen::Matrix3d Jr_inv = so3::rightJacobianInverse(e_R);
  if (jacobians[0] != nullptr) {
    Eigen::Map<StateJacobian<15>> J(jacobians[0]);
    NineRows E = NineRows::Zero();
    E.block<3, 3>(0, S::kQStored) = -Jr_inv * (j.q_WI.conjugate() * i.q_WI).toRotationMatrix();
    E.block<3, 3>(0, S::kBgStored) =
        -Jr_inv * so3::exp(e_R).toRotationMatrix().transpose() * so3::rightJacobian(dR_correction) * d.dR_dbg;
    E.block<3, 3>(3, S::kQStored) = so3::hat(p_I);
    E.block<3, 3>(3, S::kPStored) = -R_i_T;
    E.block<3, 3>(3, S::kVStored) = -T * R_i_T;
    E.block<3, 3>(3, S::kBgStored) = -d.dp_dbg;
    E.block<3, 3>(3, S::kBaStored) = -d.dp_dba;
    E.block<3, 3>(6, S::kQStored) = so3::hat(v_I);
    E.block<3, 3>(6, S::kVStored) = -R_i_T;
    E.block<3, 3>(6, S::kBgStored) = -d.dv_dbg;
    E.block<3, 3>(6, S::kBaStored) = -d.dv_dba;
    J.setZero();
    J.topRows<9>() = lowerTimes(whitening_, E);
    J.block<3, 3>(9, S::kBgStored).diagonal().setConstant(-gyro_walk_weight_);
    J.block<3, 3>(12, S::kBaStored).diagonal().setConstant(-accel_walk_weight_);
  }
  if (jacobians[1] != nullptr) {
    Eigen::Map<StateJacobian<15>> J(jacobians[1]);
    NineRows E = NineRows::Zero();
    E.block<3, 3>(0, S::kQStored) = Jr_inv;
    E.block<3, 3>(3, S::kPStored) = R_i_T;
    E.block<3, 3>(6, S::kVStored) = R_i_T;
    J.setZero();
    J.topRows<9>() = lowerTimes(whitening_, E);
    J.block<3, 3>(9, S::kBgStored).diagonal().setConstant(gyro_walk_weight_);
    J.block<3, 3>(12, S::kBaStored).diagonal().setConstant(accel_walk_weight_);
  }
  return true;
}

ImuTransition transition(const StateBlock& state_i, const Preintegration& preintegration,
                         const ImuNoise& noise) {
  const ImuDelta& d = preintegration.delta;
  const double T = d.dt;
  const Eigen::Matrix3d R_i = state_i.q_WI().toRotationMatrix();
  const Eigen::Vector3d d_bg = state_i.b_g() - preintegration.b_g;
  const Eigen::Vector3d d_ba = state_i.b_a() - preintegration.b_a;
  const Eigen::Vector3d correction = d.dR_dbg * d_bg;
  using S = StateBlock;
  ImuTransition result;
  result.A.setIdentity();
  result.A.block<3, 3>(S::kTheta, S::kTheta) = (d.dR * so3::exp(correction)).toRotationMatrix().transpose();
  result.A.block<3, 3>(S::kTheta, S::kBg) = so3::rightJacobian(correction) * d.dR_dbg;
  result.A.block<3, 3>(S::kP, S::kTheta) = -R_i * so3::hat(d.dp + d.dp_dbg * d_bg + d.dp_dba * d_ba);
  result.A.block<3, 3>(S::kP, S::kV).diagonal().setConstant(T);
  result.A.block<3, 3>(S::kP, S::kBg) = R_i * d.dp_dbg;
  result.A.block<3, 3>(S::kP, S::kBa) = R_i * d.dp_dba;
  result.A.block<3, 3>(S::kV, S::kTheta) = -R_i * so3::hat(d.dv + d.dv_dbg * d_bg + d.dv_dba * d_ba);
  result.A.block<3, 3>(S::kV, S::kBg) = R_i * d.dv_dbg;
  result.A.block<3, 3>(S::kV, S::kBa) = R_i * d.dv_dba;

  Eigen::Matrix<double, 9, 9> turn = Eigen::Matrix<double, 9, 9>::Identity();  // p and v errors stand in I_i
  turn.block<3, 3>(S::kP, S::kP) = R_i;
  turn.block<3, 3>(S::kV, S::kV) = R_i;
  result.Q.setZero();
  result.Q.topLeftCorner<9, 9>() = turn * preintegration.covariance * turn.transpose();
  result.Q.diagonal().segment<3>(S::kBg).setConstant(noise.gyro_random_walk * noise.gyro_random_walk * T);
  result.Q.diagonal().segment<3>(S::kBa).setConstant(noise.accel_random_walk * noise.accel_random_walk * T);
  return result;
}

StateBlock predict(const StateBlock& state_i, const Preintegration& preintegration,
                   const Eigen::Vector3d& g_W) {
  const ImuDelta& d = preintegration.delta;
  const Eigen::Vector3d d_bg = state_i.b_g() - preintegration.b_g;
  const Eigen::Vector3d d_ba = state_i.b_a() - preintegration.b_a;
  const Eigen::Quaterniond q_WI = state_i.q_WI();
  const double T = d.dt;
  StateBlock state_j = state_i;
  state_j.q_WI() = (q_WI * d.dR * so3::exp(d.dR_dbg * d_bg)).normalized();
  state_j.p_W() += T * state_i.v_W() + 0.5 * T * T * g_W + q_WI * (d.dp + d.dp_dbg * d_bg + d.dp_dba * d_ba);
  state_j.v_W() += T * g_W + q_WI * (d.dv + d.dv_dbg * d_bg + d.dv_dba * d_ba);
  return state_j;
}

StateBlock carried(const StateBlock& x, Time from, Time to, const ImuBuffer& imu,
                   const Eigen::Vector3d& g_W) {
  Preintegration pre;
  pre.b_g = x.b_g();
  pre.b_a = x.b_a();
  pre.delta = integrate(imu, from, to, pre.b_g, pre.b_a);
  return predict(x, pre, g_W);
}

}  // namespace rio_t
