#pragma once

#include <ceres/loss_function.h>
#include <ceres/sized_cost_function.h>

#include <Eigen/Cholesky>
#include <vector>

#include "rio_t/factors/constant_offset_factor.h"
#include "rio_t/factors/imu_factor.h"
#include "rio_t/factors/prior_factor.h"
#include "rio_t/factors/zero_velocity_factor.h"

/// The linearised window: a chain of nodes in which each factor touches one node or two neighbours.
/// Solution, marginalisation and covariance are block elimination along this chain (docs/method.md, section
/// 6).
namespace rio_t {

/// Normal equations H delta = -b of the chain.
struct ChainSystem {
  std::vector<NodeMatrix> diagonal;  ///< H_kk
  std::vector<NodeMatrix> coupling;  ///< H_k,k+1; one less than nodes
  std::vector<NodeVector> gradient;  ///< b_k = sum J'r
  double cost = 0.0;                 ///< half the sum of squares, after the loss

  /// `nodes` nodes without any information.
  explicit ChainSystem(std::size_t nodes = 0) { reset(nodes); }
  void reset(std::size_t nodes);

  /// Adds `cost_function` on the blocks (state k, t_O,k), at their values. `loss` may be null. Where
  /// `offset_known`, derivatives with respect to t_O are left out. For 3 and 16 rows.
  template <int Rows>
  void addStateAndOffset(std::size_t k,
                         const ceres::SizedCostFunction<Rows, StateBlock::kSize, 1>& cost_function,
                         const double* state, const double* t_O, const ceres::LossFunction* loss,
                         bool offset_known);
  /// The same on (state k), (t_O,k, t_O,k+1) and (state k, state k+1).
  void addState(std::size_t k, const ZeroVelocityFactor& factor, const double* state);
  void addOffsetPair(std::size_t k, const ConstantOffsetFactor& factor, const double* t_O,
                     const double* next_t_O);
  void addStatePair(std::size_t k, const ImuFactor& factor, const double* state, const double* next_state);

  /// Takes t_O,k out, as known to move by `step` [s]: its row and column are empty but for the diagonal, so
  /// that its delta comes out as zero, and the others are solved given the step.
  void holdOffset(std::size_t k, double step);
};

/// What the first node and its coupling say about the second: S = H11 - H10 H00^-1 H01, s = b1 - H10 H00^-1
/// b0.
struct NodeInformation {
  NodeMatrix S = NodeMatrix::Zero();
  NodeVector s = NodeVector::Zero();
};
/// Throws std::runtime_error where H00 is not positive definite.
NodeInformation eliminateFirst(const NodeMatrix& H00, const NodeMatrix& H01, const NodeVector& b0,
                               const NodeMatrix& H11, const NodeVector& b1);

/// The prior with information S and gradient s at (x0, t_O0): J'J = S, J'r0 = s. S may be singular: what
/// carries no information gives no rows.
NodePrior priorFromInformation(const NodeInformation& information, const StateBlock& x0, double t_O0);

using RowMajorNodeMatrix = Eigen::Matrix<double, kNodeTangent, kNodeTangent, Eigen::RowMajor>;

/// Solution of a chain; keeps its memory from call to call.
struct ChainSolution {
  std::vector<NodeVector> delta;
  double decrease = 0.0;  ///< delta' H delta = -b' delta: the squared length of the step in sigmas
  /// Of the last node's information after all others are eliminated. Never empty: Eigen leaves the state of
  /// an empty one unset, and a move would read it.
  Eigen::LLT<NodeMatrix> newest{NodeMatrix(NodeMatrix::Identity())};
  std::vector<NodeMatrix> factor;        ///< lower triangles L_k of the eliminated nodes
  std::vector<RowMajorNodeMatrix> gain;  ///< L_k^-1 H_k,k+1
};
/// Solves (H + damping diag(H)) delta = -b. False where that matrix is not positive definite.
bool solve(const ChainSystem& system, double damping, ChainSolution* solution);

/// The same without damping, but for the little that a matrix needs which only rounding made indefinite.
bool solveUndamped(const ChainSystem& system, ChainSolution* solution);

/// Marginal covariance of the last node of the chain; `solution` is solved anew.
NodeMatrix covarianceOfLast(const ChainSystem& system, ChainSolution* solution);

}  // namespace rio_t
