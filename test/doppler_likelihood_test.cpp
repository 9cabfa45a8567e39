// What the Dopplers of a scan say of the velocity: derivatives, outliers, and whether the estimate is
// unbiased and as certain as it says.
#include "rio_t/radar/doppler_likelihood.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "static_scene.h"

namespace rio_t {
namespace {

PointVariances variances(double doppler, double azimuth, double elevation, double step) {
  PointVariances noise;
  noise.doppler = doppler * doppler;
  noise.azimuth = azimuth * azimuth;
  noise.elevation = elevation * elevation;
  noise.quantization = step * step / 12.0;
  return noise;
}

/// 2.5 and 4.5 degrees.
PointVariances simulatedRadar(double step) { return variances(0.02, 0.0436, 0.0785, step); }

/// Draws scans of static points. Earlier scans have shown how far the points spread.
class Scene {
 public:
  /// `mean_elevation_sigma` [rad] is how far scans look up and down.
  explicit Scene(const PointVariances& noise_in, double elevation_spread_in = 0.35,
                 double mean_elevation_sigma = 0.0)
      : noise(noise_in), elevation_spread(elevation_spread_in), mean_elevation_sigma_(mean_elevation_sigma) {
    const double azimuths = kAzimuthSpread * kAzimuthSpread / 3.0 + noise.azimuth;
    const double elevations = elevation_spread * elevation_spread / 3.0 + noise.elevation;
    noise.azimuths = {0.0, azimuths, azimuths};
    noise.elevations = {0.0, elevations + mean_elevation_sigma * mean_elevation_sigma, elevations};
  }
  double normal() { return draw_(); }
  Eigen::Vector3d vector() { return draw_.vector(); }
  std::vector<RadarDirection> scan(const Eigen::Vector3d& v_R, std::size_t points) {
    const double step = std::sqrt(12.0 * noise.quantization);
    std::vector<RadarDirection> result;
    const double mean_elevation = mean_elevation_sigma_ > 0.0 ? mean_elevation_sigma_ * draw_() : 0.0;
    for (std::size_t i = 0; i < points; ++i) {
      const double azimuth = angle_.uniform(-kAzimuthSpread, kAzimuthSpread);
      const double elevation = mean_elevation + angle_.uniform(-elevation_spread, elevation_spread);
      double doppler = -direction(azimuth, elevation).dot(v_R) + std::sqrt(noise.doppler) * draw_();
      if (step > 0.0) doppler = step * std::round(doppler / step);
      const double measured_azimuth = azimuth + std::sqrt(noise.azimuth) * draw_();
      const double measured_elevation = elevation + std::sqrt(noise.elevation) * draw_();
      result.push_back({direction(measured_azimuth, measured_elevation), doppler, i});
    }
    return result;
  }

  PointVariances noise;
  double elevation_spread;

 private:
  static constexpr double kAzimuthSpread = 0.9;
  double mean_elevation_sigma_;
  Noise draw_{20};
  Random angle_{21};
};

// --- One point
// ------------------------------------------------------------------------------------------------------

/// Noise finer and coarser than the bin, and no bin.
const std::vector<PointVariances> kNoises = {simulatedRadar(0.0),          simulatedRadar(0.125),
                                             simulatedRadar(0.5),          variances(0.02, 0, 0, 0.0),
                                             variances(0.02, 0, 0, 0.125), variances(0.05, 0.01, 0.02, 0.125),
                                             variances(0.0, 0, 0, 0.0),    variances(0.0, 0, 0, 0.125)};

TEST(DopplerResidual, ItsDerivativeIsThatOfItsDifferences) {
  const Eigen::Vector3d v_R(0.3, 1.1, -0.2);
  for (std::size_t k = 0; k < kNoises.size(); ++k) {
    const PointVariances& noise = kNoises[k];
    Scene scene(noise);
    std::vector<RadarDirection> points = scene.scan(v_R, 40);
    // Errors from zero to far beyond anything, on both sides.
    for (std::size_t i = 0; i < points.size(); ++i)
      points[i].doppler = -points[i].u_R.dot(v_R) +
                          (i % 2 == 0 ? 1e-5 : -1e-5) * std::pow(10.0, 0.14 * static_cast<double>(i));
    const DopplerLikelihood likelihood(points, v_R, noise);
    for (const Eigen::Vector3d& at : {v_R, Eigen::Vector3d(0.35, 1.0, -0.1)}) {
      for (std::size_t i = 0; i < likelihood.size(); ++i) {
        const double h = 1e-4 * likelihood.smallestSigma();
        Eigen::Vector3d derivative, ignored, numeric;
        likelihood.residual(i, at, derivative);
        for (int axis = 0; axis < 3; ++axis) {
          const Eigen::Vector3d d = h * Eigen::Vector3d::Unit(axis);
          numeric[axis] =
              (likelihood.residual(i, at + d, ignored) - likelihood.residual(i, at - d, ignored)) / (2.0 * h);
        }
        // In units of a whole sigma.
        EXPECT_LT((derivative - numeric).norm() * likelihood.smallestSigma(), 1e-4)
            << "noise " << k << ", error " << points[i].doppler + points[i].u_R.dot(at) << "\n"
            << derivative.transpose() << "\n"
            << numeric.transpose();
      }
    }
  }
}

TEST(DopplerResidual, GrowsWithTheErrorAndIsBounded) {
  for (const PointVariances& noise : {variances(0.02, 0, 0, 0.0), variances(0.02, 0, 0, 0.125),
                                      variances(0.05, 0, 0, 0.125), variances(0.02, 0, 0, 0.5)}) {
    const Eigen::Vector3d u = direction(0.3, 0.1);
    const DopplerLikelihood likelihood({{u, -1.0, 0}}, u, noise);
    const auto residual = [&](double error) {
      Eigen::Vector3d derivative;
      const double r = likelihood.residual(0, (1.0 + error) * u, derivative);
      EXPECT_GE(derivative.dot(u), 0.0) << error;
      return r;
    };
    EXPECT_NEAR(residual(0.0), 0.0, 1e-12);
    double before = 0.0;
    for (int i = 1; i <= 10000; ++i) {
      const double e = 1e-3 * i;
      const double r = residual(e);
      EXPECT_GE(r, before) << e;
      EXPECT_NEAR(residual(-e), -r, 1e-9) << e;
      before = r;
    }
    // A point that is anything has the density of the outliers, and no pull.
    const double whole = std::sqrt(noise.doppler + noise.quantization);
    const double outlier = noise.outlier_density * std::sqrt(2.0 * M_PI) * whole;
    EXPECT_NEAR(before, std::sqrt(2.0 * std::log((1.0 + outlier) / outlier)), 0.02);
    EXPECT_EQ(residual(5.0), residual(10.0));
    Eigen::Vector3d derivative;
    likelihood.residual(0, 6.0 * u, derivative);
    EXPECT_EQ(derivative, Eigen::Vector3d::Zero());
  }
}

TEST(DopplerResidual, WithinABinNothingPulls) {
  const PointVariances noise = variances(0.01, 0, 0, 0.5);
  const Eigen::Vector3d u = direction(0.3, 0.1);
  const DopplerLikelihood likelihood({{u, -1.0, 0}}, u, noise);
  Eigen::Vector3d derivative;
  for (const double e : {-0.2, -0.1, 0.0, 0.1, 0.2}) {
    EXPECT_NEAR(likelihood.residual(0, (1.0 + e) * u, derivative), 0.0, 1e-3);
  }
  EXPECT_GT(likelihood.residual(0, 1.3 * u, derivative), 2.0);
  EXPECT_LT(likelihood.residual(0, 0.7 * u, derivative), -2.0);
}

TEST(DopplerLikelihood, AddsUpItsPoints) {
  Scene scene(simulatedRadar(0.125));
  const Eigen::Vector3d v_R(0.2, 1.5, 0.6);
  const DopplerLikelihood likelihood(scene.scan(v_R, 30), v_R, scene.noise);
  const Eigen::Vector3d at = v_R + Eigen::Vector3d(0.05, -0.1, 0.1);
  VelocityCost sum;
  for (std::size_t i = 0; i < likelihood.size(); ++i) {
    Eigen::Vector3d J;
    const double r = likelihood.residual(i, at, J);
    sum.value += 0.5 * r * r;
    sum.gradient += r * J;
    sum.information += J * J.transpose();
  }
  const VelocityCost cost = likelihood.at(at);
  EXPECT_NEAR(cost.value, sum.value, 1e-12 * sum.value);
  EXPECT_LT((cost.gradient - sum.gradient).norm(), 1e-12 * sum.gradient.norm());
  EXPECT_LT((cost.information - sum.information).norm(), 1e-12 * sum.information.norm());
}

// --- The estimate
// ---------------------------------------------------------------------------------------------------

/// The minimum near `v_R`.
Eigen::Vector3d minimum(const DopplerLikelihood& likelihood, Eigen::Vector3d v_R) {
  VelocityCost cost = likelihood.at(v_R);
  double damping = 1e-6;
  for (int i = 0; i < 100; ++i) {
    Eigen::Matrix3d damped = cost.information;
    damped.diagonal().array() += damping;
    const Eigen::Vector3d step = -damped.inverse() * cost.gradient;
    const VelocityCost next = likelihood.at(v_R + step);
    if (next.value <= cost.value) {
      v_R += step;
      cost = next;
      damping = std::max(1e-6, 0.1 * damping);
      if (step.norm() < 1e-7) break;
    } else {
      damping = std::max(1.0, 10.0 * damping);
      if (damping > 1e12) break;
    }
  }
  return v_R;
}

Eigen::Vector3d leastSquares(const std::vector<RadarDirection>& points) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const RadarDirection& p : points) {
    A += p.u_R * p.u_R.transpose();
    b -= p.doppler * p.u_R;
  }
  return A.inverse() * b;
}

struct MonteCarlo {
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d rms = Eigen::Vector3d::Zero();
  Eigen::Vector3d least_squares_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d least_squares_rms = Eigen::Vector3d::Zero();
  double nees = 0.0;
  double nees_with_bins = 0.0;
};

MonteCarlo monteCarlo(Scene scene, const Eigen::Vector3d& v_R, std::size_t points, double around) {
  constexpr int kTrials = 4000;
  MonteCarlo result;
  for (int i = 0; i < kTrials; ++i) {
    // Velocities around v_R, so that the bins are not the same each time.
    const Eigen::Vector3d truth = v_R + around * scene.vector();
    const std::vector<RadarDirection> scan = scene.scan(truth, points);
    // Placed where the estimate would be, not at the truth.
    const Eigen::Vector3d start = leastSquares(scan);
    const Eigen::Vector3d first = minimum(DopplerLikelihood(scan, start, scene.noise), start);
    const DopplerLikelihood likelihood(scan, first, scene.noise);
    const Eigen::Vector3d found = minimum(likelihood, first);
    const Eigen::Vector3d error = found - truth;
    result.bias += error / kTrials;
    result.rms += error.cwiseAbs2() / kTrials;
    const Eigen::Matrix3d information = likelihood.at(found).information;
    result.nees += error.dot(information * error) / kTrials;
    result.nees_with_bins += error.dot((information + likelihood.binInformation()) * error) / kTrials;
    result.least_squares_bias += (start - truth) / kTrials;
    result.least_squares_rms += (start - truth).cwiseAbs2() / kTrials;
  }
  result.rms = result.rms.cwiseSqrt();
  result.least_squares_rms = result.least_squares_rms.cwiseSqrt();
  return result;
}

double largest(const Eigen::Vector3d& v) { return v.cwiseAbs().maxCoeff(); }

TEST(DopplerLikelihood, NoisyDirectionsDoNotShortenTheVelocity) {
  for (const double step : {0.0, 0.125}) {
    for (const Eigen::Vector3d& v_R :
         {Eigen::Vector3d(0.1, 0.5, 0.1), Eigen::Vector3d(0.2, 1.5, 0.6), Eigen::Vector3d(0.1, 3.0, 0.15)}) {
      const MonteCarlo result = monteCarlo(Scene(simulatedRadar(step)), v_R, 45, 0.1);
      EXPECT_GT(largest(result.least_squares_bias), 0.004) << "nothing to correct at " << v_R.transpose();
      EXPECT_LT(largest(result.bias), 0.004)
          << result.bias.transpose() << " at " << v_R.transpose() << ", step " << step;
      EXPECT_GT(result.nees, 2.2) << v_R.transpose() << ", step " << step;  // bins: they say more than J'J
      EXPECT_LT(result.nees, 3.3) << v_R.transpose() << ", step " << step;
    }
  }
}

// Bins that are finer and coarser than the noise, many points and few. Three is honest.
TEST(DopplerLikelihood, ItsInformationIsHonestForAnyRadar) {
  struct Radar {
    PointVariances noise;
    std::size_t points = 0;
  };
  for (const Radar& radar :
       {Radar{variances(0.035, 0.03, 0.05, 0.0), 8}, Radar{variances(0.03, 0.02, 0.045, 0.06), 10},
        Radar{variances(0.03, 0.02, 0.045, 0.125), 30}, Radar{variances(0.02, 0, 0, 0.125), 20},
        Radar{variances(0.03, 0.02, 0.03, 0.25), 10}, Radar{variances(0.03, 0, 0, 0.49), 8},
        Radar{variances(0.03, 0.02, 0.03, 0.49), 20}, Radar{variances(0.02, 0.035, 0.05, 0.49), 80}}) {
    const MonteCarlo result = monteCarlo(Scene(radar.noise), {0.1, 3.0, 0.15}, radar.points, 0.1);
    const double step = std::sqrt(12.0 * radar.noise.quantization);
    EXPECT_GT(result.nees_with_bins, 1.3) << radar.points << " points, step " << step;
    EXPECT_LT(result.nees_with_bins, 3.4) << radar.points << " points, step " << step;
  }
}

TEST(DopplerLikelihood, SpeedsFarBelowABinAreSeenBetterThanByRounding) {
  for (const double speed : {0.08, 0.12}) {
    const MonteCarlo result = monteCarlo(Scene(simulatedRadar(0.125)), {0.0, speed, 0.0}, 70, 0.1 * speed);
    EXPECT_LT(std::abs(result.bias.y()), 0.5 * std::abs(result.least_squares_bias.y())) << speed;
    EXPECT_LT(std::abs(result.bias.y()), 0.01) << speed;
    EXPECT_LT(result.nees, 3.6) << speed;
  }
}

TEST(DopplerLikelihood, AnOutlierHasNoWeight) {
  Scene scene(variances(0.02, 0, 0, 0.125));
  const Eigen::Vector3d v_R(0.2, 1.5, 0.6);
  std::vector<RadarDirection> scan = scene.scan(v_R, 40);
  const Eigen::Vector3d without = minimum(DopplerLikelihood(scan, v_R, scene.noise), v_R);
  for (int i = 0; i < 10; ++i) scan.push_back({direction(0.2 * i - 0.9, 0.1), 2.0, scan.size()});
  const Eigen::Vector3d with = minimum(DopplerLikelihood(scan, v_R, scene.noise), v_R);
  EXPECT_LT((with - without).norm(), 1e-3);
}

/// Elevations that are as noisy as they spread: least squares sees half of the vertical velocity.
TEST(DopplerLikelihood, NoisyElevationsDoNotShortenTheVerticalVelocity) {
  const Eigen::Vector3d v_R(0.1, 1.5, 0.4);
  const MonteCarlo result = monteCarlo(Scene(variances(0.02, 0.03, 0.115, 0.0), 0.2), v_R, 80, 0.1);
  EXPECT_LT(result.least_squares_bias.z(), -0.1);
  EXPECT_LT(largest(result.bias), 0.25 * largest(result.least_squares_bias)) << result.bias.transpose();
}

/// Few points do not show how far they spread. Earlier scans have.
TEST(DopplerLikelihood, FewPointsDoNotShortenTheVelocityEither) {
  const Eigen::Vector3d v_R(0.2, 1.5, 0.6);
  const MonteCarlo result = monteCarlo(Scene(simulatedRadar(0.0)), v_R, 6, 0.1);
  EXPECT_LT(result.least_squares_bias.z(), -0.05);
  EXPECT_LT(largest(result.bias), 0.25 * largest(result.least_squares_bias)) << result.bias.transpose();
}

/// A radar that pitches looks at the floor and then at the ceiling. That the scans spread says nothing of the
/// spread within a scan.
TEST(DopplerLikelihood, ScansThatLookUpAndDownDoNotShortenTheVelocityEither) {
  const Eigen::Vector3d v_R(0.1, 1.5, 0.4);
  Scene scene(variances(0.02, 0.03, 0.115, 0.0), 0.2, 0.3);
  const MonteCarlo result = monteCarlo(scene, v_R, 20, 0.1);
  EXPECT_LT(result.least_squares_bias.z(), -0.1);
  EXPECT_LT(largest(result.bias), 0.25 * largest(result.least_squares_bias)) << result.bias.transpose();
  scene.noise.elevations.within = scene.noise.elevations.variance;
  EXPECT_GT(largest(monteCarlo(scene, v_R, 20, 0.1).bias), 2.0 * largest(result.bias));
}

/// Bias of the velocity over all scans together. `elevation` draws one; azimuths are even. The speed varies
/// by 30 %, so that the bins are not the same each time.
template <typename Elevation>
Eigen::Vector3d pooledBias(PointVariances noise, const Eigen::Vector3d& mean_v_R, int points,
                           bool skewness_is_known, const Elevation& elevation) {
  const double step = std::sqrt(12.0 * noise.quantization);
  PointNoise learned{noise};
  Random random(22);
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (int k = 0; k < 100000 / points; ++k) {
    const Eigen::Vector3d v_R = random.uniform(0.7, 1.3) * mean_v_R;
    std::vector<RadarDirection> scan;
    for (int i = 0; i < points; ++i) {
      const double az = random.uniform(-0.9, 0.9), el = elevation(random);
      const double doppler = -direction(az, el).dot(v_R) + std::sqrt(noise.doppler) * random.normal();
      scan.push_back({direction(az + std::sqrt(noise.azimuth) * random.normal(),
                                el + std::sqrt(noise.elevation) * random.normal()),
                      step > 0.0 ? step * std::round(doppler / step) : doppler, 0});
    }
    learned.learnSpread(scan);
    if (k < 300) continue;
    noise.azimuths = learned.variances().azimuths;
    noise.elevations = learned.variances().elevations;
    if (!skewness_is_known) noise.elevations.skewness = 0.0;
    const VelocityCost cost = DopplerLikelihood(scan, v_R, noise).at(v_R);
    gradient += cost.gradient;
    information += cost.information;
  }
  return information.inverse() * gradient;
}

/// Elevations with a noise of 8 degrees.
PointVariances radarOfNoisyElevations() { return variances(0.02, 0.03, 0.14, 0.0); }

/// With a variance of its own for each point the bias is 0.01 m/s.
TEST(DopplerLikelihood, EvenElevationsLeaveNoBiasOfTheVerticalVelocity) {
  const auto elevation = [](Random& random) { return random.uniform(-0.35, 0.35); };
  EXPECT_LT(std::abs(pooledBias(radarOfNoisyElevations(), {0.3, 1.5, 0.1}, 40, true, elevation).z()), 0.004);
}

/// A bin that is wider than the noise tells most by its edges. They are sharp where a point has little noise:
/// with one variance for all points the bias to the side is 0.015 m/s.
TEST(DopplerLikelihood, WideBinsKeepTheNoiseOfEachPoint) {
  const PointVariances noise = variances(0.03, 0.09, 0.14, 0.49);
  const Eigen::Vector3d v_R(-0.26, 0.48, -0.23);  // 0.6 m/s, 30 degrees to the side and 22 down
  const auto elevation = [](Random& random) { return random.uniform(-1.4, 1.4); };
  EXPECT_LT(std::abs(pooledBias(noise, v_R, 6, true, elevation).x()), 0.008);
}

/// More points lie below the mean elevation than above, as a radar sees the floor and a few walls.
TEST(DopplerLikelihood, SkewedElevationsLeaveNoVerticalVelocity) {
  const auto elevation = [](Random& random) {
    const double root = random.uniform(0.0, 1.0);
    return -0.35 + 0.9 * root * root;
  };
  const PointVariances noise = radarOfNoisyElevations();
  for (const int points : {5, 40}) {
    const double bias = std::abs(pooledBias(noise, {0.0, 1.2, 0.0}, points, false, elevation).z());
    EXPECT_GT(bias, 0.025) << points;
    EXPECT_LT(std::abs(pooledBias(noise, {0.0, 1.2, 0.0}, points, true, elevation).z()), 0.25 * bias)
        << points;
  }
}

TEST(DopplerLikelihood, WhatAPlanarScanDoesNotSeeStaysWhereItWas) {
  const Eigen::Vector3d v_R(0.3, 1.5, 0.4);
  Scene scene(simulatedRadar(0.125), 0.0);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  constexpr int kTrials = 500;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<RadarDirection> scan = scene.scan(v_R, 40);
    // A flat radar reports all points in its plane.
    for (RadarDirection& p : scan) p.u_R = Eigen::Vector3d(p.u_R.x(), p.u_R.y(), 0.0).normalized();
    const DopplerLikelihood likelihood(scan, v_R, scene.noise);
    const VelocityCost cost = likelihood.at(v_R + Eigen::Vector3d(0.05, 0.02, 0.3));
    EXPECT_LT(std::abs(cost.gradient.z()), 1e-9 * cost.gradient.norm());
    EXPECT_LT(cost.information.col(2).norm(), 1e-9 * cost.information.norm());
    const Eigen::Vector3d found = minimum(likelihood, v_R);
    EXPECT_NEAR(found.z(), v_R.z(), 1e-6);
    sum += (found - v_R) / kTrials;
  }
  EXPECT_LT(sum.head<2>().norm(), 0.01) << sum.transpose();
}

TEST(DopplerLikelihood, AScanThatIsPlanarButForItsNoiseDoesNotRunAway) {
  const Eigen::Vector3d v_R(0.3, 1.5, 0.4);
  Scene scene(simulatedRadar(0.125), 0.0);
  int ran_away = 0;
  for (int trial = 0; trial < 500; ++trial) {
    const DopplerLikelihood likelihood(scene.scan(v_R, 40), v_R, scene.noise);
    ran_away += std::abs(minimum(likelihood, v_R).z()) > 1.5 ? 1 : 0;
  }
  EXPECT_EQ(ran_away, 0);
}

}  // namespace
}  // namespace rio_t
