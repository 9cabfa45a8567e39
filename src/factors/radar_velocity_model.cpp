#include "rio_t/factors/radar_velocity_model.h"

#include "rio_t/core/so3.h"

namespace rio_t {

bool RadarVelocityModel::isCurrent(Time mean_time) const {
  return mean_ && mean_->time == mean_time &&
         (mean_->imu_until == model_.imu->newest() || mean_->imu_until - mean_time > scan_.offset_half_width);
}

PredictedVelocity RadarVelocityModel::at(double const* const* parameters, bool derivatives) const {
  const Extrinsics mounting = toExtrinsics(parameters[3]);
  const Extrinsics& T_IR = scan_.slow ? scan_.slow->T_IR : mounting;
  const double t_O = scan_.linear_from_t_O ? *scan_.linear_from_t_O : parameters[2][0];
  const double away = parameters[2][0] - t_O;
  const bool is_linear = away != 0.0 && scan_.offset_gain > 0.0;
  // The value may depend on the mean, too.
  const bool needs_mean = derivatives || is_linear || model_.kind == TimeOffsetModel::kConstantAcceleration;
  const Time mean_time = model_.meanTime(scan_.stamp, t_O);
  if (needs_mean && !isCurrent(mean_time))
    mean_ = Mean{mean_time, model_.imu->newest(), model_.imu->mean(mean_time, scan_.offset_half_width)};
  const RadarMotion motion = model_.at(StateView(parameters[0], parameters[1]), state_time_, scan_.stamp, t_O,
                                       T_IR.l_I, needs_mean ? &mean_->value : nullptr);
  const Eigen::Matrix3d R_RI = T_IR.R_RI();
  PredictedVelocity predicted;
  predicted.dv_dt_O = scan_.offset_gain * (R_RI * motion.dv_dt_O);
  predicted.v_R = R_RI * motion.v_I;
  if (is_linear) predicted.v_R += away * predicted.dv_dt_O;
  Eigen::Matrix3d by_turn, by_lever;  // derivatives of v_R
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();
  if (scan_.slow) {
    by_turn = so3::hat(scan_.slow->v_R) * R_RI;
    by_lever = R_RI * so3::hat(scan_.slow->omega_I);
    turn = turnBetween(T_IR, mounting);
    predicted.v_R += by_turn * turn + by_lever * (mounting.l_I - T_IR.l_I);
  }
  if (!derivatives) return predicted;
  if (!scan_.slow) {
    by_turn = so3::hat(predicted.v_R) * R_RI;
    by_lever = R_RI * so3::hat(motion.omega_I - away * scan_.offset_gain * motion.alpha_I);
  }
  predicted.J_motion = R_RI * motion.J_motion;
  predicted.J_biases = R_RI * motion.J_biases;
  predicted.J_extrinsics.setZero();
  // The block turns on the left: Log(Exp(d) Exp(turn)) ~ turn + Jr^-1(-turn) d.
  predicted.J_extrinsics.leftCols<3>() = by_turn * so3::rightJacobianInverse(-turn);
  predicted.J_extrinsics.rightCols<3>() = by_lever;
  return predicted;
}

}  // namespace rio_t
