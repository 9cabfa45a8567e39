#pragma once

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

#include "rio_t/factors/extrinsics_manifold.h"
#include "rio_t/factors/state_block.h"

namespace rio_t {

/// Velocity of a point of the vehicle in the vehicle frame V (x forward, y left, z up), and its derivatives:
/// v_V = R_VI (R_IW v_W + (omega - b_g) x p_IV).
struct VehicleVelocity {
  Eigen::Vector3d v_V;         ///< [m/s]
  MotionJacobian<3> J_motion;  ///< as StateBlock stores it
  BiasJacobian<3> J_biases;
  ExtrinsicsJacobian<3> J_frame;  ///< as ExtrinsicsBlock stores it
};
/// `T_IV`: q_IV, and p_IV, the point in I [m]. `omega_I` is what the gyro reads [rad/s], bias included.
VehicleVelocity vehicleVelocity(const StateView& x, const Extrinsics& T_IV, const Eigen::Vector3d& omega_I);

/// [s] The gyro is averaged over this time to either side of a node. A vibration would act on the lever arm.
constexpr double kVehicleGyroHalfWidth = 0.05;

/// A wheeled vehicle moves neither sideways nor up (docs/method.md, section 5.9): residual (v_V,y, v_V,z),
/// each over its sigma. Blocks: motion, biases, vehicle frame (ExtrinsicsBlock, its lever arm held).
class GroundVehicleFactor final
    : public ceres::SizedCostFunction<2, StateBlock::kMotion, StateBlock::kBiases, ExtrinsicsBlock::kSize> {
 public:
  /// `sigmas`: sideways and vertical [m/s].
  GroundVehicleFactor(const Eigen::Vector3d& omega_I, const Eigen::Vector2d& sigmas)
      : omega_I_(omega_I), weights_(sigmas.cwiseInverse()) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  Eigen::Vector3d omega_I_;
  Eigen::Vector2d weights_;
};

/// The vehicle stands on level ground: residual (u_x, u_y) / sigma of the upward axis of W in V,
/// u = R_VI R_IW e_z. Blocks: motion, vehicle frame.
class LevelGroundFactor final
    : public ceres::SizedCostFunction<2, StateBlock::kMotion, ExtrinsicsBlock::kSize> {
 public:
  /// `slope_sigma`: sigma of the slope of the ground, along and across [rad].
  explicit LevelGroundFactor(double slope_sigma) : weight_(1.0 / slope_sigma) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  double weight_;
};

}  // namespace rio_t
