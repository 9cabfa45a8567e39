#include "rio_t/core/so3.h"

#include <gtest/gtest.h>

namespace rio_t {
namespace {

const double kAngles[] = {0.0, 1e-9, 1e-6, 1e-5, 1.5e-4, 1e-3, 0.1, 1.0, 2.5, 3.1};

Eigen::Vector3d vector(double angle) { return angle * Eigen::Vector3d(0.3, -0.8, 0.52).normalized(); }

TEST(So3, LogInvertsExp) {
  for (const double angle : kAngles) {
    EXPECT_LT((so3::log(so3::exp(vector(angle))) - vector(angle)).norm(), 1e-12 * (1.0 + angle)) << angle;
  }
}

TEST(So3, LogTakesTheShortWay) {
  const Eigen::Quaterniond q = so3::exp(vector(1.0));
  const Eigen::Quaterniond same(-q.w(), -q.x(), -q.y(), -q.z());
  EXPECT_LT((so3::log(same) - vector(1.0)).norm(), 1e-12);
}

TEST(So3, RightJacobianIsTheDerivativeOfExp) {
  for (const double angle : kAngles) {
    const Eigen::Vector3d phi = vector(angle);
    Eigen::Matrix3d numeric;
    const double h = 1e-6;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d d = h * Eigen::Vector3d::Unit(i);
      numeric.col(i) = so3::log(so3::exp(phi - d).conjugate() * so3::exp(phi + d)) / (2.0 * h);
    }
    EXPECT_LT((so3::rightJacobian(phi) - numeric).norm(), 1e-8) << angle;
  }
}

TEST(So3, RightJacobianInverseIsTheInverse) {
  for (const double angle : kAngles) {
    const Eigen::Vector3d phi = vector(angle);
    const Eigen::Matrix3d product = so3::rightJacobian(phi) * so3::rightJacobianInverse(phi);
    EXPECT_LT((product - Eigen::Matrix3d::Identity()).norm(), 1e-9) << angle;
  }
}

}  // namespace
}  // namespace rio_t
