#pragma once

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>

#include <vector>

#include "rio_t/factors/prior_factor.h"

/// The linearised window: a chain of nodes in which each factor touches one node or two neighbours.
/// Marginalisation and covariance are block elimination along this chain (docs/method.md, eq. 23-27).
namespace rio_t {

/// Normal equations H delta = -b of the chain.
struct ChainSystem {
  std::vector<NodeMatrix> diagonal;  ///< H_kk
  std::vector<NodeMatrix> coupling;  ///< H_k,k+1; one less than nodes
  std::vector<NodeVector> gradient;  ///< b_k = sum J'r

  /// `nodes` nodes without any information.
  explicit ChainSystem(std::size_t nodes);

  /// Adds `cost` on the blocks (state k, t_O,k), or (state k), or (t_O,k, t_O,k+1), or (state k, state k+1),
  /// at their values. `loss` may be null. Where `offset_known`, derivatives with respect to t_O are left out.
  void addStateAndOffset(std::size_t k, const ceres::CostFunction& cost, const double* state,
                         const double* t_O, const ceres::LossFunction* loss, bool offset_known);
  void addState(std::size_t k, const ceres::CostFunction& cost, const double* state);
  void addOffsetPair(std::size_t k, const ceres::CostFunction& cost, const double* t_O,
                     const double* next_t_O);
  void addStatePair(std::size_t k, const ceres::CostFunction& cost, const double* state,
                    const double* next_state);
};

/// What the first node and its coupling say about the second: S = H11 - H10 H00^-1 H01, s = b1 - H10 H00^-1
/// b0.
struct NodeInformation {
  NodeMatrix S = NodeMatrix::Zero();
  NodeVector s = NodeVector::Zero();
};
NodeInformation eliminateFirst(const NodeMatrix& H00, const NodeMatrix& H01, const NodeVector& b0,
                               const NodeMatrix& H11, const NodeVector& b1);

/// The prior with information S and gradient s at (x0, t_O0): J'J = S, J'r0 = s. S may be singular: what
/// carries no information gives no rows.
NodePrior priorFromInformation(const NodeInformation& information, const StateBlock& x0, double t_O0);

/// Marginal covariance of the last node of the chain.
NodeMatrix covarianceOfLast(const ChainSystem& system);

}  // namespace rio_t
