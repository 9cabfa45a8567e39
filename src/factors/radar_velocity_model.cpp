#include "rio_t/factors/radar_velocity_model.h"

namespace rio_t {

PredictedVelocity RadarVelocityModel::at(double const* const* parameters, bool derivatives) const {
  const double t_O = scan_.held_t_O.value_or(parameters[1][0]);
  const Time mean_time = model_.meanTime(scan_.stamp, t_O);
  if (derivatives && (!mean_ || mean_->time != mean_time)) mean_ = Mean{mean_time, model_.meanAt(mean_time)};
  const RadarMotion motion = model_.at(parameters[0], state_time_, scan_.stamp, t_O, scan_.T_IR.l_I,
                                       derivatives ? &mean_->value : nullptr);
  const Eigen::Matrix3d R_RI = scan_.T_IR.R_RI();
  PredictedVelocity predicted;
  predicted.v_R = R_RI * motion.v_I;
  if (!derivatives) return predicted;
  predicted.J_state = R_RI * motion.J_state;
  if (!scan_.held_t_O) predicted.dv_dt_O = scan_.offset_gain * (R_RI * motion.dv_dt_O);
  return predicted;
}

}  // namespace rio_t
