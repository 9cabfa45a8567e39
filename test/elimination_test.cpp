// Elimination, marginalisation and square roots against dense linear algebra, on linear windows.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "dense_system.h"
#include "linear_window.h"
#include "noise.h"
#include "rio_t/graph/marginalization.h"
#include "rio_t/graph/solver.h"

namespace rio_t {
namespace {

TEST(Elimination, SolvesLikeTheDenseSystem) {
  const LinearWindow linear(5);
  const LinearSystem system = linearize(linear.window);
  const Dense dense(system);
  const Eigen::VectorXd expected = dense.H.ldlt().solve(-dense.b);
  const auto elimination = Elimination::of(system);
  ASSERT_TRUE(elimination);
  for (std::size_t i = 0; i < dense.first.size(); ++i) {
    const Eigen::VectorXd& delta = elimination->delta()[i];
    EXPECT_LT((delta - expected.segment(dense.first[i], delta.size())).norm(), 1e-9 * expected.norm());
  }
  EXPECT_NEAR(elimination->squaredLength(), expected.dot(dense.H * expected),
              1e-9 * elimination->squaredLength());
}

TEST(Elimination, CovariancesAreThoseOfTheDenseInverse) {
  const LinearWindow linear(5);
  const LinearSystem system = linearize(linear.window);
  const Dense dense(system);
  const Eigen::MatrixXd inverse = dense.H.inverse();
  const auto elimination = Elimination::of(system);
  ASSERT_TRUE(elimination);
  // A node in the middle and the calibration.
  Eigen::MatrixXd expected(5, 5);
  const Eigen::Index a = dense.first[2], c = dense.first[5];
  expected << inverse.block(a, a, 3, 3), inverse.block(a, c, 3, 2), inverse.block(c, a, 2, 3),
      inverse.block(c, c, 2, 2);
  EXPECT_LT((elimination->covariance({2, 5}) - expected).norm(), 1e-9 * expected.norm());
  const auto all = elimination->covariances();
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (const auto& [j, P] : all[i])
      EXPECT_LT((P - inverse.block(dense.first[i], dense.first[j], P.rows(), P.cols())).norm(),
                1e-9 * inverse.norm());
  }
}

TEST(Elimination, AHeldBlockHasNoErrorAndTakesNoStep) {
  const LinearWindow linear(5);
  LinearSystem system = linearize(linear.window);
  system.hold(5);  // the calibration
  const auto elimination = Elimination::of(system);
  ASSERT_TRUE(elimination);
  EXPECT_TRUE(elimination->delta()[5].isZero(0.0));
  EXPECT_GT(elimination->squaredLength(), 0.0);
  const Eigen::MatrixXd P = elimination->covariance({2, 5});
  EXPECT_GT(P.topLeftCorner(3, 3).diagonal().minCoeff(), 0.0);
  EXPECT_TRUE(P.rightCols(2).isZero(0.0)) << P;
  EXPECT_TRUE(elimination->covariances()[5].at(5).isZero(0.0));
}

/// An outlier has hardly any derivative. Its square underflows.
TEST(Elimination, ATinyDerivativeCountsAsNone) {
  for (const double tiny : {1e-150, 1e-160, 1e-170, 1e-300}) {
    LinearWindow linear(5);
    LinearSystem system = linearize(linear.window);
    for (LinearRows& each : system.rows)
      if (each.blocks == std::vector<int>{0, 5} || each.blocks == std::vector<int>{1, 5})
        each.Jr.middleCols(3, 2) *= tiny;
    const Dense dense(system);
    const Eigen::VectorXd expected = dense.H.ldlt().solve(-dense.b);
    const auto elimination = Elimination::of(system);
    ASSERT_TRUE(elimination) << tiny;
    for (std::size_t i = 0; i < dense.first.size(); ++i) {
      const Eigen::VectorXd& delta = elimination->delta()[i];
      EXPECT_LT((delta - expected.segment(dense.first[i], delta.size())).norm(), 1e-9 * expected.norm())
          << tiny;
    }
  }
}

TEST(Elimination, WhatIsNotDeterminedIsRefused) {
  Window window;
  window.addNode(Time(), std::make_shared<VectorManifold>(3), Eigen::VectorXd::Zero(3));
  EXPECT_FALSE(Elimination::of(linearize(window)));
  EXPECT_THROW(solve(window, {}), std::runtime_error);
  // A column that depends on the others leaves rounding on the diagonal.
  for (int seed = 0; seed < 20; ++seed) {
    Window dependent;
    Block& node = dependent.addNode(Time(), std::make_shared<VectorManifold>(3), Eigen::VectorXd::Zero(3));
    dependent.add(std::make_unique<LinearCost>(5, std::vector<int>{3}, seed), {&node});
    LinearSystem system = linearize(dependent);
    auto& Jr = system.rows.front().Jr;
    ASSERT_TRUE(Elimination::of(system)) << seed;
    Jr.col(2) = 0.1 * Jr.col(0) + 0.7 * Jr.col(1);
    EXPECT_FALSE(Elimination::of(system)) << seed;
  }
}

TEST(Marginalization, LeavesTheSolutionOfTheRest) {
  LinearWindow linear(5);
  const Eigen::MatrixXd before = linearized(linear.window).elimination.covariance({3, 4, 5});
  solve(linear.window, {});
  const Eigen::VectorXd newest = linear.nodes[4]->x, calibration = linear.calibration->x;
  for (Block* node : {linear.nodes[4], linear.nodes[3]})
    node->x.setConstant(0.7);  // it is linear: the point is free
  marginalize(linear.window, {linear.nodes[0]}, {});
  marginalize(linear.window, {linear.nodes[1], linear.nodes[2]}, {});
  ASSERT_EQ(linear.window.blocks().size(), 3U);
  EXPECT_EQ(linear.window.terms().size(), 4U);  // two nodes with the calibration, one between, one prior
  solve(linear.window, {});
  EXPECT_LT((linear.nodes[4]->x - newest).norm(), 1e-6 * newest.norm());
  EXPECT_LT((linear.calibration->x - calibration).norm(), 1e-6 * calibration.norm());
  EXPECT_LT((linearized(linear.window).elimination.covariance({0, 1, 2}) - before).norm(),
            1e-9 * before.norm());
}

TEST(Marginalization, AWalkWidensWhatThePriorSays) {
  // Two equal windows; in the second the walk is a block of its own.
  LinearWindow a(3), b(3);
  constexpr double kVariance = 0.3;
  marginalize(a.window, {a.nodes[0]}, {{a.calibration.get(), Eigen::VectorXd::Constant(2, kVariance)}});
  marginalize(b.window, {b.nodes[0]}, {});
  const Term* prior = b.window.terms().back().get();
  // The prior of b moves to a calibration before the walk.
  Dense dense(linearize({b.nodes[1], b.calibration.get()}, {prior}));
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(7, 7);
  H.topLeftCorner(5, 5) = dense.H;
  for (int i = 0; i < 2; ++i) {
    H(3 + i, 3 + i) += 1.0 / kVariance;
    H(5 + i, 5 + i) += 1.0 / kVariance;
    H(3 + i, 5 + i) = H(5 + i, 3 + i) = -1.0 / kVariance;
  }
  const Eigen::MatrixXd all = H.inverse();
  Eigen::MatrixXd expected(5, 5);
  expected << all.topLeftCorner(3, 3), all.topRightCorner(3, 2), all.bottomLeftCorner(2, 3),
      all.bottomRightCorner(2, 2);
  const Dense widened(linearize({a.nodes[1], a.calibration.get()}, {a.window.terms().back().get()}));
  EXPECT_LT((widened.H.inverse() - expected).norm(), 1e-6 * expected.norm());
}

TEST(Marginalization, KeepsWhatIsHardlyKnown) {
  // A chain of numbers. Only the first is observed, a billion times worse than each knows the next.
  Window window;
  const auto one = std::make_shared<VectorManifold>(1);
  constexpr double kSigma = 1e3, kStep = 1e-6;
  const auto root = [](std::vector<double> row) {
    return SquareRoot{Eigen::Map<Eigen::RowVectorXd>(row.data(), static_cast<Eigen::Index>(row.size())),
                      Eigen::VectorXd::Zero(1)};
  };
  Block* last = &window.addNode(Time(), one, Eigen::VectorXd::Zero(1));
  addPrior(window, {last}, root({1.0 / kSigma}));
  for (int k = 1; k < 3000; ++k) {
    Block& next = window.addNode(Time::fromSeconds(0.01 * k), one, Eigen::VectorXd::Zero(1));
    addPrior(window, {last, &next}, root({-1.0 / kStep, 1.0 / kStep}));
    marginalize(window, {last}, {});
    last = &next;
  }
  EXPECT_NEAR(std::sqrt(linearized(window).elimination.covariance({0})(0, 0)), kSigma, 1e-3 * kSigma);
}

TEST(SquareRoot, WidenedByNothingSaysTheSame) {
  SquareRoot rows{Eigen::MatrixXd(11, 8), Eigen::VectorXd(11)};
  for (int i = 0; i < rows.J.size(); ++i) rows.J(i) = wave(5 + i);
  rows.J.col(3) *= 1e6;  // as different as metres and biases
  for (int i = 0; i < rows.r0.size(); ++i) rows.r0(i) = wave(40 + i);
  const SquareRoot root = widened(rows, Eigen::VectorXd::Zero(rows.J.cols()));
  ASSERT_EQ(root.J.rows(), 8);
  const Eigen::VectorXd scale = rows.J.colwise().norm().cwiseInverse();
  const Eigen::MatrixXd J = rows.J * scale.asDiagonal(), again = root.J * scale.asDiagonal();
  EXPECT_LT((again.transpose() * again - J.transpose() * J).norm(), 1e-12);
  EXPECT_LT((again.transpose() * root.r0 - J.transpose() * rows.r0).norm(), 1e-12);
}

TEST(SquareRoot, LeavesTheUnknownFree) {
  SquareRoot rows{Eigen::MatrixXd::Zero(6, 4), Eigen::VectorXd::Zero(6)};
  rows.J(1, 2) = 2.0;
  rows.r0(1) = 0.5;
  const SquareRoot root = widened(rows, Eigen::VectorXd::Zero(rows.J.cols()));
  EXPECT_LT((root.J.transpose() * root.J - rows.J.transpose() * rows.J).norm(), 1e-12);
  EXPECT_LT((root.J.transpose() * root.r0 - rows.J.transpose() * rows.r0).norm(), 1e-12);
}

/// What a window rounds must not depend on where its memory lies.
TEST(Window, KeepsTheOrderOfTheTermsThatStay) {
  std::vector<std::unique_ptr<LinearWindow>> windows;
  std::vector<std::size_t> first;
  for (int k = 0; k < 20; ++k) {
    windows.push_back(std::make_unique<LinearWindow>(12));
    Window& window = windows.back()->window;
    for (const std::size_t node : {3U, 0U, 7U}) window.remove(*windows.back()->nodes[node]);
    std::vector<ceres::ResidualBlockId> in_problem;
    window.problem().GetResidualBlocks(&in_problem);
    std::vector<std::size_t> order;
    for (const auto& term : window.terms())
      order.push_back(static_cast<std::size_t>(
          std::find(in_problem.begin(), in_problem.end(), term->in_problem) - in_problem.begin()));
    if (k == 0) first = order;
    EXPECT_EQ(order, first) << "window " << k;
  }
}

}  // namespace
}  // namespace rio_t
