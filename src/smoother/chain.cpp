#include "rio_t/smoother/chain.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace rio_t {
namespace {

constexpr int kState = StateBlock::kTangent;
using RowMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, kNodeTangent, kNodeTangent>;
using Residual = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kNodeTangent, 1>;
using Tangents = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kNodeTangent, kNodeTangent>;

struct Linearization {
  Residual r;
  RowMatrix J0, J1;  // as the solver's: row-major, in storage columns
};

Linearization evaluate(const ceres::CostFunction& cost, const double* block0, const double* block1) {
  const int rows = cost.num_residuals();
  const std::vector<int>& sizes = cost.parameter_block_sizes();
  Linearization lin{Residual(rows), RowMatrix(rows, sizes[0]),
                    RowMatrix(rows, sizes.size() > 1 ? sizes[1] : 0)};
  const double* blocks[] = {block0, block1};
  double* jacobians[] = {lin.J0.data(), lin.J1.data()};
  if (!cost.Evaluate(blocks, lin.r.data(), jacobians))
    throw std::runtime_error("chain: a factor cannot be evaluated");
  return lin;
}

/// Drops the empty fourth column (see StateJacobian).
Tangents tangent(const RowMatrix& J) {
  Tangents T(J.rows(), kState);
  T.leftCols<3>() = J.leftCols<3>();
  T.rightCols<kState - 3>() = J.rightCols<kState - 3>();
  return T;
}

}  // namespace

ChainSystem::ChainSystem(std::size_t nodes)
    : diagonal(nodes, NodeMatrix::Zero()),
      coupling(nodes > 0 ? nodes - 1 : 0, NodeMatrix::Zero()),
      gradient(nodes, NodeVector::Zero()) {}

void ChainSystem::addStateAndOffset(std::size_t k, const ceres::CostFunction& cost, const double* state,
                                    const double* t_O, const ceres::LossFunction* loss, bool offset_known) {
  Linearization lin = evaluate(cost, state, t_O);
  double weight = 1.0;
  if (loss != nullptr) {
    double rho[3];
    loss->Evaluate(lin.r.squaredNorm(), rho);
    weight = rho[1];
  }
  const Tangents J = tangent(lin.J0);
  diagonal[k].topLeftCorner<kState, kState>() += weight * J.transpose() * J;
  gradient[k].head<kState>() += weight * J.transpose() * lin.r;
  if (offset_known) return;
  const Residual J_t = lin.J1.col(0);
  diagonal[k].topRightCorner<kState, 1>() += weight * J.transpose() * J_t;
  diagonal[k].bottomLeftCorner<1, kState>() += weight * J_t.transpose() * J;
  diagonal[k](kState, kState) += weight * J_t.squaredNorm();
  gradient[k](kState) += weight * J_t.dot(lin.r);
}

void ChainSystem::addState(std::size_t k, const ceres::CostFunction& cost, const double* state) {
  const Linearization lin = evaluate(cost, state, nullptr);
  const Tangents J = tangent(lin.J0);
  diagonal[k].topLeftCorner<kState, kState>() += J.transpose() * J;
  gradient[k].head<kState>() += J.transpose() * lin.r;
}

void ChainSystem::addOffsetPair(std::size_t k, const ceres::CostFunction& cost, const double* t_O,
                                const double* next_t_O) {
  const Linearization lin = evaluate(cost, t_O, next_t_O);
  const double a = lin.J0(0, 0);
  const double b = lin.J1(0, 0);
  diagonal[k](kState, kState) += a * a;
  diagonal[k + 1](kState, kState) += b * b;
  coupling[k](kState, kState) += a * b;
  gradient[k](kState) += a * lin.r(0);
  gradient[k + 1](kState) += b * lin.r(0);
}

void ChainSystem::addStatePair(std::size_t k, const ceres::CostFunction& cost, const double* state,
                               const double* next_state) {
  const Linearization lin = evaluate(cost, state, next_state);
  const Tangents J0 = tangent(lin.J0);
  const Tangents J1 = tangent(lin.J1);
  diagonal[k].topLeftCorner<kState, kState>() += J0.transpose() * J0;
  diagonal[k + 1].topLeftCorner<kState, kState>() += J1.transpose() * J1;
  coupling[k].topLeftCorner<kState, kState>() += J0.transpose() * J1;
  gradient[k].head<kState>() += J0.transpose() * lin.r;
  gradient[k + 1].head<kState>() += J1.transpose() * lin.r;
}

NodeInformation eliminateFirst(const NodeMatrix& H00, const NodeMatrix& H01, const NodeVector& b0,
                               const NodeMatrix& H11, const NodeVector& b1) {
  const Eigen::LDLT<NodeMatrix> factor(H00);
  if (factor.info() != Eigen::Success) throw std::runtime_error("chain: a node cannot be eliminated");
  const NodeMatrix gain = factor.solve(H01);  // H00^-1 H01
  NodeInformation result;
  result.S = H11 - H01.transpose() * gain;
  result.S = (0.5 * (result.S + result.S.transpose())).eval();
  result.s = b1 - gain.transpose() * b0;
  return result;
}

NodePrior priorFromInformation(const NodeInformation& information, const StateBlock& x0, double t_O0) {
  // The entries differ by many orders of magnitude (metres, biases): scale to a unit diagonal first, so that
  // "carries no information" does not depend on the units.
  const NodeVector scale = information.S.diagonal().cwiseMax(0.0).cwiseSqrt();
  const NodeVector inverse = (scale.array() > 0.0).select(scale.cwiseInverse(), NodeVector::Zero());
  const NodeMatrix scaled = inverse.asDiagonal() * information.S * inverse.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<NodeMatrix> eigen(scaled);
  const NodeVector lambda = eigen.eigenvalues();
  const double floor = 1e-12 * std::max(lambda.maxCoeff(), 0.0);

  NodePrior prior;
  prior.x0 = x0;
  prior.t_O0 = t_O0;
  for (int i = 0; i < kNodeTangent; ++i) {
    if (lambda(i) <= floor) continue;
    const NodeVector v = eigen.eigenvectors().col(i);
    const double root = std::sqrt(lambda(i));
    prior.J.row(i) = root * v.cwiseProduct(scale).transpose();
    prior.r0(i) = v.dot(inverse.cwiseProduct(information.s)) / root;
  }
  return prior;
}

NodeMatrix covarianceOfLast(const ChainSystem& system) {
  NodeInformation information;
  information.S = system.diagonal.front();
  for (std::size_t k = 0; k + 1 < system.diagonal.size(); ++k) {
    information = eliminateFirst(information.S, system.coupling[k], NodeVector::Zero(),
                                 system.diagonal[k + 1], NodeVector::Zero());
  }
  const NodeMatrix covariance = information.S.ldlt().solve(NodeMatrix::Identity());
  return 0.5 * (covariance + covariance.transpose());
}

}  // namespace rio_t
