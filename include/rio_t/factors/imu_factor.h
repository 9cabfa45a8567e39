#pragma once

#include <ceres/sized_cost_function.h>

#include "rio_t/factors/state_block.h"
#include "rio_t/imu/preintegration.h"

namespace rio_t {

/// Preintegrated IMU between nodes i and j, which share their biases. Blocks: motion i, motion j, biases.
///
/// docs/method.md, eq. 12; paper eq. (11); Forster et al. eq. (45). With the change of the biases since the
/// integration, d_g and d_a, and the time between the nodes, T:
///   e_R  = Log((dR Exp(dR_dbg d_g))^T R_i^T R_j)
///   e_p  = R_i^T (p_j - p_i - v_i T - g T^2 / 2) - (dp + dp_dbg d_g + dp_dba d_a)
///   e_v  = R_i^T (v_j - v_i - g T) - (dv + dv_dbg d_g + dv_dba d_a)
/// all whitened with the covariance of the preintegration.
class ImuFactor final
    : public ceres::SizedCostFunction<9, StateBlock::kMotion, StateBlock::kMotion, StateBlock::kBiases> {
 public:
  ImuFactor(const Preintegration& preintegration, const Eigen::Vector3d& g_W);
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  Preintegration pre_;
  Eigen::Vector3d g_W_;
  Eigen::Matrix<double, 9, 9> whitening_;  ///< W with W'W = covariance^-1
};

/// Mean of state j given state i. The caller integrates `delta` at the biases of state i.
StateBlock predict(const StateBlock& state_i, const ImuDelta& delta, const Eigen::Vector3d& g_W);

/// Integrates the IMU from the state `x` at `from` to `to`, forwards or backwards, with the biases of `x`.
StateBlock carried(const StateBlock& x, Time from, Time to, const ImuBuffer& imu, const Eigen::Vector3d& g_W);

/// How an error of state i, biases included, propagates to the predicted motion j: d_j = A d_i + noise with
/// covariance Q, in tangents. It is the whitened factor, J_i d_i + J_j d_j ~ N(0, 1), solved for d_j.
/// The preintegration is at the biases of state i.
struct ImuTransition {
  Eigen::Matrix<double, StateBlock::kMotionTangent, StateBlock::kTangent> A;
  Eigen::Matrix<double, StateBlock::kMotionTangent, StateBlock::kMotionTangent> Q;
};
ImuTransition transition(const StateBlock& state_i, const Preintegration& preintegration);

}  // namespace rio_t
