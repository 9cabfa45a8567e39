// The algebra of a cost: its root, which the factor hands to Ceres, and the error that points share.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <vector>

#include "rio_t/radar/doppler_likelihood.h"
#include "static_scene.h"

namespace rio_t {
namespace {

/// Of rank 0 to 3, also where the first axes are those that nothing is known of.
std::vector<Eigen::Matrix3d> semidefinites() {
  std::vector<Eigen::Matrix3d> result = {Eigen::Matrix3d::Zero()};
  const Eigen::Vector3d a(1.3, -0.4, 0.7), b(0.2, 2.0, -0.5), c(-0.9, 0.3, 1.1);
  for (const double scale : {1e-6, 1.0, 1e6}) {
    const Eigen::Matrix3d one = scale * a * a.transpose();
    const Eigen::Matrix3d two = one + scale * b * b.transpose();
    result.push_back(one);
    result.push_back(two);
    result.emplace_back(two + scale * c * c.transpose());
    for (int i = 0; i < 3; ++i) {
      result.emplace_back(scale * Eigen::Vector3d::Unit(i) * Eigen::Vector3d::Unit(i).transpose());
      result.emplace_back(scale * (Eigen::Matrix3d::Identity() -
                                   Eigen::Vector3d::Unit(i) * Eigen::Vector3d::Unit(i).transpose()));
    }
  }
  return result;
}

TEST(SemidefiniteRoot, IsARootWhateverTheRank) {
  for (const Eigen::Matrix3d& A : semidefinites()) {
    const Eigen::Matrix3d U = semidefiniteRoot(A);
    EXPECT_LE((U.transpose() * U - A).norm(), 1e-12 * A.norm()) << A;
    EXPECT_EQ(U(1, 0), 0.0);
    EXPECT_EQ(U(2, 0), 0.0);
    EXPECT_EQ(U(2, 1), 0.0);
  }
}

TEST(SemidefiniteRoot, SolvesWhatIsInItsRange) {
  for (const Eigen::Matrix3d& A : semidefinites()) {
    const Eigen::Matrix3d U = semidefiniteRoot(A);
    const Eigen::Vector3d b = A * Eigen::Vector3d(0.3, -1.2, 0.8);
    const Eigen::Vector3d x = solveTransposed(U, b);
    EXPECT_LE((U.transpose() * x - b).norm(), 1e-9 * b.norm()) << A;
    for (int i = 0; i < 3; ++i) {
      if (U.row(i).isZero(0.0)) {
        EXPECT_EQ(x[i], 0.0);
      }
    }
  }
}

VelocityCost someCost(const Eigen::Matrix3d& information) {
  VelocityCost cost;
  cost.value = 30.0;
  cost.information = information;
  cost.gradient = information * Eigen::Vector3d(0.04, -0.02, 0.05);
  return cost;
}

Eigen::Matrix3d someInformation() {
  Eigen::Matrix3d A;
  A << 400.0, 50.0, -20.0, 50.0, 900.0, 30.0, -20.0, 30.0, 80.0;
  return A;
}

TEST(SharedError, AddsItsVariancesToThoseOfThePoints) {
  const Eigen::Vector3d D(1.6e-3, 4.0e-4, 1.0e-2);
  const VelocityCost alone = someCost(someInformation());
  Eigen::Vector3d error;
  const VelocityCost shared = withSharedError(alone, D, &error);
  const Eigen::Matrix3d D_matrix = D.asDiagonal();
  const Eigen::Matrix3d expected = (alone.information.inverse() + D_matrix).inverse();
  EXPECT_LT((shared.information - expected).norm(), 1e-12 * expected.norm());
  // The same minimum, from where the cost rises by the information that remains.
  const Eigen::Vector3d to_minimum = -alone.information.inverse() * alone.gradient;
  EXPECT_LT((shared.gradient + expected * to_minimum).norm(), 1e-10 * shared.gradient.norm());
  EXPECT_NEAR(shared.value - 0.5 * to_minimum.dot(expected * to_minimum),
              alone.value - 0.5 * to_minimum.dot(alone.information * to_minimum), 1e-10);
  // The error that costs least, its own cost included.
  const auto whole = [&](const Eigen::Vector3d& e) {
    return alone.value + alone.gradient.dot(e) + 0.5 * e.dot(alone.information * e) +
           0.5 * (e.array().square() / D.array()).sum();
  };
  EXPECT_NEAR(shared.value, whole(error), 1e-10);
  for (int i = 0; i < 3; ++i)
    for (const double h : {-1e-3, 1e-3}) EXPECT_GT(whole(error + h * Eigen::Vector3d::Unit(i)), shared.value);
}

TEST(SharedError, OfNothingChangesNothing) {
  for (const Eigen::Matrix3d& A : semidefinites()) {
    const VelocityCost alone = someCost(A);
    Eigen::Vector3d error = Eigen::Vector3d::Ones();
    const VelocityCost shared = withSharedError(alone, Eigen::Vector3d::Zero(), &error);
    EXPECT_EQ(shared.value, alone.value);
    EXPECT_EQ(shared.gradient, alone.gradient);
    EXPECT_EQ(shared.information, alone.information);
    EXPECT_EQ(error, Eigen::Vector3d::Zero());
  }
}

TEST(SharedError, LeavesUnseenWhatIsUnseenAndAnAxisWithoutItAlone) {
  // One point, and an error of one axis alone.
  const Eigen::Vector3d u = direction(0.4, 0.2);
  const VelocityCost alone = someCost(900.0 * u * u.transpose());
  const Eigen::Vector3d D(0.0, 2e-3, 0.0);
  const Eigen::Matrix3d expected = u * u.transpose() / (1.0 / 900.0 + u.y() * u.y() * D.y());
  const VelocityCost shared = withSharedError(alone, D);
  EXPECT_LT((shared.information - expected).norm(), 1e-12 * expected.norm());
}

}  // namespace
}  // namespace rio_t
