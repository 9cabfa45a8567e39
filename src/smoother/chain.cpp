#include "rio_t/smoother/chain.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace rio_t {
namespace {

constexpr int kState = StateBlock::kTangent;
constexpr int kStored = StateBlock::kSize;
constexpr int kLinear = kState - 3;  // of the tangent after theta
/// Smallest diagonal of a scaled Cholesky factor that still says something, as a square root of 1e-12.
constexpr double kWellDetermined = 1e-6;
/// After a long way hardly anything is known of the position: 1/(200 m)^2 beside the 1/(4 um)^2 of an IMU
/// factor over 5 ms is within the rounding of a double, and an elimination may come out indefinite. Then the
/// diagonal is lifted by as little as it takes.
constexpr double kSmallestLift = 1e-15;
constexpr double kLargestLift = 1e-9;

/// Adds what stands in the order of storage, with an empty fourth row and column (see StateJacobian), to the
/// part of a node's matrix that belongs to the states.
void addStored(const Eigen::Matrix<double, kStored, kStored>& stored, NodeMatrix& H) {
  H.topLeftCorner<3, 3>() += stored.topLeftCorner<3, 3>();
  H.block<3, kLinear>(0, 3) += stored.topRightCorner<3, kLinear>();
  H.block<kLinear, 3>(3, 0) += stored.bottomLeftCorner<kLinear, 3>();
  H.block<kLinear, kLinear>(3, 3) += stored.bottomRightCorner<kLinear, kLinear>();
}

template <typename Stored, typename Tangent>
void addStoredVector(const Stored& stored, Tangent&& tangent) {
  tangent.template head<3>() += stored.template head<3>();
  tangent.template segment<kLinear>(3) += stored.template tail<kLinear>();
}

/// W <- L^-1 W for the lower triangle of L. By whole rows: at this size Eigen's blocked solver costs twice as
/// much.
void forwardSubstitute(const NodeMatrix& L, RowMajorNodeMatrix& W) {
  for (int i = 0; i < kNodeTangent; ++i) {
    for (int j = 0; j < i; ++j) W.row(i) -= L(i, j) * W.row(j);
    W.row(i) /= L(i, i);
  }
}

template <typename CostFunction>
void evaluate(const CostFunction& cost, const double* block0, const double* block1, double* residual,
              double* J0, double* J1) {
  const double* blocks[] = {block0, block1};
  double* jacobians[] = {J0, J1};
  if (!cost.Evaluate(blocks, residual, jacobians))
    throw std::runtime_error("chain: a factor cannot be evaluated");
}

}  // namespace

void ChainSystem::reset(std::size_t nodes) {
  diagonal.assign(nodes, NodeMatrix::Zero());
  coupling.assign(nodes > 0 ? nodes - 1 : 0, NodeMatrix::Zero());
  gradient.assign(nodes, NodeVector::Zero());
  cost = 0.0;
}

template <int Rows>
void ChainSystem::addStateAndOffset(std::size_t k,
                                    const ceres::SizedCostFunction<Rows, kStored, 1>& cost_function,
                                    const double* state, const double* t_O, const ceres::LossFunction* loss,
                                    bool offset_known) {
  Eigen::Matrix<double, Rows, 1> r, J_t;
  StateJacobian<Rows> J;
  evaluate(cost_function, state, t_O, r.data(), J.data(), J_t.data());
  double rho[3] = {r.squaredNorm(), 1.0, 0.0};
  if (loss != nullptr) loss->Evaluate(rho[0], rho);
  cost += 0.5 * rho[0];
  if (loss != nullptr) {
    const double root = std::sqrt(rho[1]);
    r *= root;
    J *= root;
    J_t *= root;
  }
  NodeMatrix& H = diagonal[k];
  addStored(J.transpose().lazyProduct(J), H);
  addStoredVector((J.transpose().lazyProduct(r)).eval(), gradient[k]);
  if (offset_known) return;
  const Eigen::Matrix<double, kStored, 1> cross = J.transpose().lazyProduct(J_t);
  addStoredVector(cross, H.col(kState));
  addStoredVector(cross, H.row(kState).transpose());
  H(kState, kState) += J_t.squaredNorm();
  gradient[k](kState) += J_t.dot(r);
}
template void ChainSystem::addStateAndOffset<3>(std::size_t, const ceres::SizedCostFunction<3, kStored, 1>&,
                                                const double*, const double*, const ceres::LossFunction*,
                                                bool);
template void ChainSystem::addStateAndOffset<kNodeTangent>(
    std::size_t, const ceres::SizedCostFunction<kNodeTangent, kStored, 1>&, const double*, const double*,
    const ceres::LossFunction*, bool);

void ChainSystem::addState(std::size_t k, const ZeroVelocityFactor& factor, const double* state) {
  Eigen::Vector3d r;
  StateJacobian<3> J;
  evaluate(factor, state, nullptr, r.data(), J.data(), nullptr);
  cost += 0.5 * r.squaredNorm();
  addStored(J.transpose().lazyProduct(J), diagonal[k]);
  addStoredVector((J.transpose().lazyProduct(r)).eval(), gradient[k]);
}

void ChainSystem::addOffsetPair(std::size_t k, const ConstantOffsetFactor& factor, const double* t_O,
                                const double* next_t_O) {
  double r = 0.0, a = 0.0, b = 0.0;
  evaluate(factor, t_O, next_t_O, &r, &a, &b);
  cost += 0.5 * r * r;
  diagonal[k](kState, kState) += a * a;
  diagonal[k + 1](kState, kState) += b * b;
  coupling[k](kState, kState) += a * b;
  gradient[k](kState) += a * r;
  gradient[k + 1](kState) += b * r;
}

void ChainSystem::addStatePair(std::size_t k, const ImuFactor& factor, const double* state,
                               const double* next_state) {
  Eigen::Matrix<double, 15, 1> r;
  StateJacobian<15> J0, J1;
  evaluate(factor, state, next_state, r.data(), J0.data(), J1.data());
  cost += 0.5 * r.squaredNorm();
  // The first nine rows are the preintegration, which touches b_g and b_a of the first state only.
  constexpr int kMotionStored = StateBlock::kBgStored;
  using Stored = Eigen::Matrix<double, kStored, kStored>;
  const auto A0 = J0.topRows<9>();
  const auto A1 = J1.topLeftCorner<9, kMotionStored>();
  const auto r9 = r.head<9>();
  Stored H00 = A0.transpose().lazyProduct(A0);
  Stored H01 = Stored::Zero();
  Stored H11 = Stored::Zero();
  Eigen::Matrix<double, kStored, 1> b0 = A0.transpose().lazyProduct(r9);
  Eigen::Matrix<double, kStored, 1> b1 = Eigen::Matrix<double, kStored, 1>::Zero();
  H01.leftCols<kMotionStored>() = A0.transpose().lazyProduct(A1);
  H11.topLeftCorner<kMotionStored, kMotionStored>() = A1.transpose().lazyProduct(A1);
  b1.head<kMotionStored>() = A1.transpose().lazyProduct(r9);
  // The other six are the walk of the biases, one row for each.
  for (int row = 9; row < 15; ++row) {
    const int column = StateBlock::kBgStored + row - 9;
    const double a = J0(row, column);
    const double b = J1(row, column);
    H00(column, column) += a * a;
    H01(column, column) += a * b;
    H11(column, column) += b * b;
    b0(column) += a * r(row);
    b1(column) += b * r(row);
  }
  addStored(H00, diagonal[k]);
  addStored(H01, coupling[k]);
  addStored(H11, diagonal[k + 1]);
  addStoredVector(b0, gradient[k]);
  addStoredVector(b1, gradient[k + 1]);
}

void ChainSystem::holdOffset(std::size_t k, double step) {
  NodeMatrix& H = diagonal[k];
  gradient[k] += step * H.col(kState);
  H.col(kState).setZero();
  H.row(kState).setZero();
  H(kState, kState) = 1.0;
  gradient[k](kState) = 0.0;
  if (k > 0) {
    gradient[k - 1] += step * coupling[k - 1].col(kState);
    coupling[k - 1].col(kState).setZero();
  }
  if (k + 1 < diagonal.size()) {
    gradient[k + 1] += step * coupling[k].row(kState).transpose();
    coupling[k].row(kState).setZero();
  }
}

NodeInformation eliminateFirst(const NodeMatrix& H00, const NodeMatrix& H01, const NodeVector& b0,
                               const NodeMatrix& H11, const NodeVector& b1) {
  Eigen::LLT<NodeMatrix> factor(H00);
  for (double lift = kSmallestLift; factor.info() != Eigen::Success; lift *= 10.0) {
    if (lift > kLargestLift) throw std::runtime_error("chain: a node cannot be eliminated");
    NodeMatrix lifted = H00;
    lifted.diagonal() *= 1.0 + lift;
    factor.compute(lifted);
  }
  RowMajorNodeMatrix gain = H01;
  forwardSubstitute(factor.matrixLLT(), gain);
  NodeInformation result;
  result.S = H11 - gain.transpose().lazyProduct(gain);
  result.s = b1 - gain.transpose() * factor.matrixL().solve(b0);
  return result;
}

NodePrior priorFromInformation(const NodeInformation& information, const StateBlock& x0, double t_O0) {
  // The entries differ by many orders of magnitude (metres, biases): scale to a unit diagonal first, so that
  // "carries no information" does not depend on the units.
  const NodeVector scale = information.S.diagonal().cwiseMax(0.0).cwiseSqrt();
  const NodeVector inverse = (scale.array() > 0.0).select(scale.cwiseInverse(), NodeVector::Zero());
  const NodeMatrix scaled = inverse.asDiagonal() * information.S * inverse.asDiagonal();
  NodePrior prior;
  prior.x0 = x0;
  prior.t_O0 = t_O0;
  const Eigen::LLT<NodeMatrix> cholesky(scaled);
  if (cholesky.info() == Eigen::Success && cholesky.matrixLLT().diagonal().minCoeff() > kWellDetermined) {
    prior.J = NodeMatrix(cholesky.matrixU()) * scale.asDiagonal();
    prior.r0 = cholesky.matrixL().solve(inverse.cwiseProduct(information.s));
    return prior;
  }
  const Eigen::SelfAdjointEigenSolver<NodeMatrix> eigen(scaled);
  const NodeVector& lambda = eigen.eigenvalues();
  const double floor = 1e-12 * std::max(lambda.maxCoeff(), 0.0);

  for (int i = 0; i < kNodeTangent; ++i) {
    if (lambda(i) <= floor) continue;
    const NodeVector v = eigen.eigenvectors().col(i);
    const double root = std::sqrt(lambda(i));
    prior.J.row(i) = root * v.cwiseProduct(scale).transpose();
    prior.r0(i) = v.dot(inverse.cwiseProduct(information.s)) / root;
  }
  return prior;
}

bool solve(const ChainSystem& system, double damping, ChainSolution* solution) {
  const std::size_t count = system.diagonal.size();
  ChainSolution& x = *solution;
  x.delta.resize(count);
  x.factor.resize(count);
  x.gain.resize(count);
  NodeMatrix S;
  for (std::size_t k = 0; k < count; ++k) {
    S = system.diagonal[k];
    if (damping > 0.0) S.diagonal() *= 1.0 + damping;
    x.delta[k] = -system.gradient[k];
    if (k > 0) {
      S -= x.gain[k - 1].transpose().lazyProduct(x.gain[k - 1]);
      x.delta[k].noalias() -= x.gain[k - 1].transpose() * x.delta[k - 1];
    }
    x.newest.compute(S);
    if (x.newest.info() != Eigen::Success) return false;
    x.factor[k] = x.newest.matrixLLT();
    const auto L = x.factor[k].triangularView<Eigen::Lower>();
    L.solveInPlace(x.delta[k]);  // L^-1 (-b), until the way back
    if (k + 1 == count) break;
    x.gain[k] = system.coupling[k];
    forwardSubstitute(x.factor[k], x.gain[k]);
  }
  x.decrease = 0.0;
  for (std::size_t k = count; k-- > 0;) {
    if (k + 1 < count) x.delta[k].noalias() -= x.gain[k] * x.delta[k + 1];
    x.factor[k].triangularView<Eigen::Lower>().transpose().solveInPlace(x.delta[k]);
    x.decrease -= x.delta[k].dot(system.gradient[k]);
  }
  return true;
}

bool solveUndamped(const ChainSystem& system, ChainSolution* solution) {
  bool solved = solve(system, 0.0, solution);
  for (double lift = kSmallestLift; !solved && lift <= kLargestLift; lift *= 10.0)
    solved = solve(system, lift, solution);
  return solved;
}

NodeMatrix covarianceOfLast(const ChainSystem& system, ChainSolution* solution) {
  if (!solveUndamped(system, solution)) throw std::runtime_error("chain: the window is not determined");
  return solution->newest.solve(NodeMatrix::Identity());
}

}  // namespace rio_t
