// ResidualMoments predicts squared residuals. These tests draw points and compare.
#include "../src/radar/residual_moments.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "static_scene.h"

namespace rio_t {
namespace {

struct View {
  Eigen::Vector3d v_R;
  double azimuth, elevation;  // half the angle of view [rad]
};

void expectMoments(const View& view, const ScanNoise& sigmas) {
  constexpr int kPoints = 200000;
  PointVariances noise;
  noise.azimuth = sigmas.azimuth * sigmas.azimuth;
  noise.elevation = sigmas.elevation * sigmas.elevation;
  ResidualMoments moments(view.v_R);
  Random random(50);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero(), squares = Eigen::Vector3d::Zero();
  for (int i = 0; i < kPoints; ++i) {
    const double azimuth = random.uniform(-view.azimuth, view.azimuth);
    const double elevation =
        random.uniform(-view.elevation, view.elevation) - 0.1;  // the radar sees the floor
    const Eigen::Vector3d u_R =
        direction(azimuth + sigmas.azimuth * random.normal(), elevation + sigmas.elevation * random.normal());
    const double doppler = -direction(azimuth, elevation).dot(view.v_R) + sigmas.doppler * random.normal();
    const double residual = doppler + u_R.dot(view.v_R);
    moments.add(u_R, 1.0);
    const Eigen::Vector3d each = residual * residual * moments.weights(u_R);
    sum += each;
    squares += each.cwiseAbs2();
  }
  const Eigen::Vector3d expected = moments.shares(noise) * Eigen::Vector3d(sigmas.doppler * sigmas.doppler,
                                                                           noise.azimuth, noise.elevation);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(sum[i], expected[i], 4.0 * std::sqrt(squares[i])) << i;
}

TEST(ResidualMoments, AreThoseOfDrawnPoints) {
  for (const Eigen::Vector3d& v_R : {Eigen::Vector3d(0.3, 1.5, 0.1), Eigen::Vector3d(1.0, 0.5, -0.8)})
    for (const double elevation : {0.17, 0.35, 0.8})
      for (const ScanNoise& sigmas : {ScanNoise{0.05, 0.14, 0.1}, ScanNoise{0.12, 0.03, 0.02}})
        expectMoments({v_R, 1.0, elevation}, sigmas);
}

TEST(ResidualMoments, WeightsAreTheSquaredDerivativesOfTheRadialSpeed) {
  const Eigen::Vector3d v_R(0.3, 1.5, -0.4);
  const double az = 0.7, el = -0.3, h = 1e-6;
  const double by_az = (direction(az + h, el) - direction(az - h, el)).dot(v_R) / (2.0 * h) / std::cos(el);
  const double by_el = (direction(az, el + h) - direction(az, el - h)).dot(v_R) / (2.0 * h);
  const Eigen::Vector3d weights = ResidualMoments(v_R).weights(direction(az, el));
  EXPECT_DOUBLE_EQ(weights[0], 1.0);
  EXPECT_NEAR(weights[1], by_az * by_az, 1e-8);
  EXPECT_NEAR(weights[2], by_el * by_el, 1e-8);
}

/// Without noise the sums have no spread, and what little noise would add is known all the same.
TEST(ResidualMoments, OfNoNoiseAreTheSquaredDerivatives) {
  const Eigen::Vector3d v_R(0.3, 1.5, -0.4), u_R = direction(0.7, -0.3);
  ResidualMoments moments(v_R);
  moments.add(u_R, 2.0);
  const Eigen::Vector3d weights = moments.weights(u_R);
  const double cosine = std::cos(-0.3);
  const Eigen::Vector3d shares(1.0, cosine * cosine * weights[1], weights[2]);
  EXPECT_LT((moments.shares(PointVariances()) - 2.0 * weights * shares.transpose()).norm(), 1e-4);
}

}  // namespace
}  // namespace rio_t
