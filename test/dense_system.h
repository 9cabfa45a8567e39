#pragma once

#include <Eigen/Core>
#include <numeric>
#include <vector>

#include "rio_t/graph/linear_system.h"

namespace rio_t {

/// The normal equations H delta = -b of a linear system, as dense matrices. A block that is held has a unit
/// diagonal.
struct Dense {
  explicit Dense(const LinearSystem& system) {
    Eigen::Index size = 0;
    for (int i = 0; i < static_cast<int>(system.tangents.size()); ++i) {
      first.push_back(size);
      size += system.tangent(i);
    }
    H = Eigen::MatrixXd::Zero(size, size);
    b = Eigen::VectorXd::Zero(size);
    for (const LinearRows& rows : system.rows) {
      Eigen::MatrixXd J = Eigen::MatrixXd::Zero(rows.Jr.rows(), size);
      Eigen::Index from = 0;
      for (const int i : rows.blocks) {
        J.middleCols(first[static_cast<std::size_t>(i)], system.tangent(i)) =
            rows.Jr.middleCols(from, system.tangent(i));
        from += system.tangent(i);
      }
      H += J.transpose() * J;
      b += J.transpose() * rows.Jr.rightCols<1>();
    }
    for (std::size_t i = 0; i < first.size(); ++i)
      if (system.is_held[i]) H.diagonal().segment(first[i], system.tangent(static_cast<int>(i))).setOnes();
  }
  std::vector<Eigen::Index> first;
  Eigen::MatrixXd H;
  Eigen::VectorXd b;
};

}  // namespace rio_t
