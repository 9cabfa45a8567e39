#include "rio_t/factors/ground_vehicle_factor.h"

#include "rio_t/core/so3.h"

namespace rio_t {

VehicleVelocity vehicleVelocity(const StateView& x, const Extrinsics& T_IV, const Eigen::Vector3d& omega_I) {
  const Eigen::Matrix3d R_VI = T_IV.R_RI();
  const Eigen::Matrix3d R_IW = x.q_WI.conjugate().toRotationMatrix();
  const Eigen::Vector3d v_I = R_IW * x.v_W;
  const Eigen::Vector3d omega = omega_I - x.b_g;
  const Eigen::Vector3d point_I = v_I + omega.cross(T_IV.l_I);

  VehicleVelocity result;
  result.v_V = R_VI * point_I;
  result.J_motion.setZero();
  result.J_motion.leftCols<3>() = R_VI * so3::hat(v_I);
  result.J_motion.middleCols<3>(StateBlock::kVStored) = R_VI * R_IW;
  result.J_biases << R_VI * so3::hat(T_IV.l_I), Eigen::Matrix3d::Zero();
  result.J_frame.setZero();
  result.J_frame.leftCols<3>() = R_VI * so3::hat(point_I);
  result.J_frame.rightCols<3>() = R_VI * so3::hat(omega);
  return result;
}

bool GroundVehicleFactor::Evaluate(double const* const* parameters, double* residuals,
                                   double** jacobians) const {
  const VehicleVelocity velocity =
      vehicleVelocity(StateView(parameters[0], parameters[1]), toExtrinsics(parameters[2]), omega_I_);
  Eigen::Map<Eigen::Vector2d>{residuals} = weights_.cwiseProduct(velocity.v_V.tail<2>());
  if (jacobians == nullptr) return true;
  store(weights_.asDiagonal() * velocity.J_motion.bottomRows<2>(), jacobians[0]);
  store(weights_.asDiagonal() * velocity.J_biases.bottomRows<2>(), jacobians[1]);
  store(weights_.asDiagonal() * velocity.J_frame.bottomRows<2>(), jacobians[2]);
  return true;
}

bool LevelGroundFactor::Evaluate(double const* const* parameters, double* residuals,
                                 double** jacobians) const {
  const Eigen::Vector3d up_I = MotionView(parameters[0]).q_WI.conjugate() * Eigen::Vector3d::UnitZ();
  const Eigen::Matrix3d R_VI = toExtrinsics(parameters[1]).R_RI();
  Eigen::Map<Eigen::Vector2d>{residuals} = weight_ * (R_VI * up_I).head<2>();
  if (jacobians == nullptr) return true;
  const Eigen::Matrix<double, 2, 3> turned = weight_ * (R_VI * so3::hat(up_I)).topRows<2>();
  store((MotionJacobian<2>() << turned, Eigen::Matrix<double, 2, 7>::Zero()).finished(), jacobians[0]);
  store((ExtrinsicsJacobian<2>() << turned, Eigen::Matrix<double, 2, 4>::Zero()).finished(), jacobians[1]);
  return true;
}

}  // namespace rio_t
