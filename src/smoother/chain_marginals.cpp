#include "rio_t/smoother/chain_marginals.h"

#include <Eigen/Cholesky>
#include <stdexcept>

namespace rio_t {
namespace {

NodeMatrix symmetric(const NodeMatrix& A) { return 0.5 * (A + A.transpose()); }

}  // namespace

std::vector<NodeMatrix> marginalCovariances(const ChainSystem& system) {
  const std::size_t count = system.diagonal.size();
  std::vector<NodeMatrix> P(count);  // going forward S_k^-1, going back the covariance
  std::vector<NodeMatrix> gain(count > 0 ? count - 1 : 0);
  NodeMatrix S;
  for (std::size_t k = 0; k < count; ++k) {
    S = system.diagonal[k];
    if (k > 0) S -= system.coupling[k - 1].transpose() * gain[k - 1];
    const Eigen::LLT<NodeMatrix> factor(symmetric(S));
    if (factor.info() != Eigen::Success) throw std::runtime_error("chain: a node is not determined");
    P[k] = factor.solve(NodeMatrix::Identity());
    if (k + 1 < count) gain[k] = factor.solve(system.coupling[k]);
  }
  // Only sums of positive terms on the way back, so every block stays positive definite.
  for (std::size_t k = count; k-- > 0;) {
    if (k + 1 < count) P[k] += gain[k] * P[k + 1] * gain[k].transpose();
    P[k] = symmetric(P[k]);
  }
  return P;
}

}  // namespace rio_t
