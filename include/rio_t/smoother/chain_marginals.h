#pragma once

#include <vector>

#include "rio_t/smoother/chain.h"

namespace rio_t {

/// Marginal covariance of every node of the chain: the diagonal blocks of H^-1, by elimination along the
/// chain and substitution back (docs/method.md, eq. 42). Linear in the count of nodes. Throws
/// std::runtime_error where a node is not determined.
std::vector<NodeMatrix> marginalCovariances(const ChainSystem& system);

}  // namespace rio_t
