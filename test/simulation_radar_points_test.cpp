// The points of the simulated radar: how many, where, and their Doppler.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

#include "rio_t/simulation/radar_model.h"
#include "simulation_setup.h"

namespace rio_t::simulation {
namespace {

TEST(RadarModel, ShowsAsManyPointsAsAreAskedFor) {
  for (const int points : {20, 120, 1000}) {
    SimulationOptions options = withoutErrors();
    options.radar.points_mean = points;
    options.radar.points_sigma = 0.0;
    options.radar.points_max = points;
    double mean = 0.0;
    const SensorData data = simulate(builtIn("difficult"), options);
    for (const SimulatedScan& scan : data.scans)
      mean += static_cast<double>(scan.points.size()) / static_cast<double>(data.scans.size());
    EXPECT_NEAR(mean, points, 0.02 * points);
    options.radar.points_max = points - 1;
    EXPECT_THROW(simulate(builtIn("difficult"), options), std::invalid_argument);
  }
}

TEST(RadarModel, QuantisesTheDoppler) {
  SimulationOptions options;
  options.radar.doppler_step = 0.125;
  std::size_t moving = 0;
  for (const SimulatedScan& scan : simulate(builtIn("medium"), options).scans) {
    for (const SimulatedPoint& point : scan.points) {
      ASSERT_EQ(point.doppler, 0.125 * std::round(point.doppler / 0.125));
      moving += point.doppler != 0.0 ? 1 : 0;
    }
  }
  EXPECT_GT(moving, 1000u);
}

TEST(RadarModel, WrapsTheDopplerIntoItsSpan) {
  const Motion motion = builtIn("ground_vehicle", 1, 40.0);  // up to 5 m/s
  for (const double step : {0.0, 0.125}) {
    for (const double span : {3.0, 2.875}) {  // an even and an odd number of steps
      SimulationOptions options;
      options.radar.doppler_step = step;
      const SensorData unlimited = simulate(motion, options);
      options.radar.doppler_span = span;
      const SensorData limited = simulate(motion, options);
      ASSERT_EQ(limited.scans.size(), unlimited.scans.size());
      std::size_t wrapped = 0, first_bin = 0;
      for (std::size_t k = 0; k < limited.scans.size(); ++k) {
        // Only the Doppler differs, so that each point is its own truth.
        ASSERT_EQ(limited.scans[k].points.size(), unlimited.scans[k].points.size());
        for (std::size_t i = 0; i < limited.scans[k].points.size(); ++i) {
          const double seen = limited.scans[k].points[i].doppler;
          const double whole = unlimited.scans[k].points[i].doppler;
          ASSERT_GE(seen, -0.5 * span);
          ASSERT_LT(seen, 0.5 * span);
          ASSERT_NEAR((whole - seen) / span, std::round((whole - seen) / span), 1e-9) << whole;
          if (step > 0.0) {
            ASSERT_EQ(seen, step * std::round(seen / step));
          }
          wrapped += seen != whole ? 1 : 0;
          first_bin += step > 0.0 && seen < -0.5 * span + step ? 1 : 0;
        }
      }
      EXPECT_GT(wrapped, 1000u);
      // Both ends of the span meet there.
      if (step > 0.0) {
        EXPECT_GT(first_bin, 20u);
      }
    }
  }
}

TEST(RadarModel, WithoutNoiseTheSpanIsAllThatIsMissing) {
  SimulationOptions options = withoutErrors();
  options.radar.doppler_span = 3.0;
  options.radar.removeErrors();
  std::size_t wrapped = 0;
  for (const SimulatedScan& scan : simulate(builtIn("ground_vehicle", 1, 40.0), options).scans) {
    for (const SimulatedPoint& point : scan.points) {
      const double truth = -point.position_R.normalized().dot(scan.v_R);
      const double spans = (truth - point.doppler) / 3.0;
      ASSERT_NEAR(spans, std::round(spans), 1e-9);
      wrapped += std::abs(spans) > 0.5 ? 1 : 0;
    }
  }
  EXPECT_GT(wrapped, 1000u);
}

TEST(RadarModel, RefusesASpanThatIsNoWholeNumberOfSteps) {
  const Motion motion = builtIn("easy", 1, 30.0);
  SimulationOptions options;
  options.radar.doppler_step = 0.49;
  for (const double span : {3.0, 0.1, -2.94}) {
    options.radar.doppler_span = span;
    try {
      simulate(motion, options);
      FAIL() << "no exception for " << span;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find("doppler-span"), std::string::npos) << error.what();
    }
  }
  options.radar.doppler_span = 2.94;  // 6 steps, but not quite in floating point
  EXPECT_NO_THROW(simulate(motion, options));
}

TEST(RadarModel, AFlatRadarReportsAllInItsPlane) {
  SimulationOptions options;
  options.radar.ghost_share = 0.2;
  options.radar.fov_elevation = 5.0;
  options.radar.measures_elevation = false;
  const Motion motion = builtIn("ground_vehicle", 1, 40.0);
  std::size_t count = 0;
  for (const SimulatedScan& scan : simulate(motion, options).scans) {
    for (const SimulatedPoint& point : scan.points) {
      ASSERT_EQ(point.position_R.z(), 0.0);
      ASSERT_GE(point.position_R.y(), 0.0);
      ++count;
    }
  }
  EXPECT_GT(count, 5000u);

  // The same reflectors with and without elevation: range and angle to the row of antennas are those of the
  // things seen, which are not in the plane themselves.
  options.radar.removeErrors();
  const SensorData flat = simulate(motion, options);
  options.radar.measures_elevation = true;
  const SensorData truth = simulate(motion, options);
  double highest = 0.0;
  for (std::size_t k = 0; k < flat.scans.size(); ++k) {
    ASSERT_EQ(flat.scans[k].points.size(), truth.scans[k].points.size());
    for (std::size_t i = 0; i < flat.scans[k].points.size(); ++i) {
      const SimulatedPoint& seen = flat.scans[k].points[i];
      const Eigen::Vector3d& p_R = truth.scans[k].points[i].position_R;
      ASSERT_EQ(seen.position_R.z(), 0.0);
      ASSERT_NEAR(seen.position_R.norm(), p_R.norm(), 1e-9);
      ASSERT_NEAR(seen.position_R.x(), p_R.x(), 1e-9);
      ASSERT_EQ(seen.doppler, truth.scans[k].points[i].doppler);
      highest = std::max(highest, std::abs(std::asin(p_R.z() / p_R.norm())));
    }
  }
  EXPECT_NEAR(highest, 5.0 * 3.141592653589793 / 180.0, 0.005);
}

TEST(RadarModel, SparseScansMayBeEmptyAndThenNotPublished) {
  const Motion motion = builtIn("medium");
  SimulationOptions options;
  options.radar.moving_share = 0.0;
  options.radar.points_mean = 3.0;
  options.radar.points_sigma = 2.0;
  EXPECT_EQ(sortedCounts(simulate(motion, options).scans).front(), 1);  // the limit as it has always been

  options.radar.points_min = 0;
  const SensorData all = simulate(motion, options);
  const std::vector<int> counts = sortedCounts(all.scans);
  ASSERT_EQ(counts.size(), all.scans.size());
  double total = 0.0;
  for (const int few : {0, 1, 2, 3, 4}) {
    const auto share = static_cast<double>(std::count(counts.begin(), counts.end(), few)) /
                       static_cast<double>(counts.size());
    EXPECT_GT(share, 0.05) << few;
    total += share;
  }
  EXPECT_NEAR(total, 0.77, 0.06);  // a normal distribution below 4.5

  options.radar.publish_empty = false;
  const SensorData some = simulate(motion, options);
  ASSERT_EQ(some.scans.size(), all.scans.size());
  for (std::size_t k = 0; k < all.scans.size(); ++k) {
    EXPECT_EQ(some.scans[k].delivered, !all.scans[k].points.empty());
    EXPECT_EQ(some.scans[k].seq, all.scans[k].seq);
    ASSERT_EQ(some.scans[k].points.size(), all.scans[k].points.size());
    if (!some.scans[k].points.empty()) {
      EXPECT_EQ(some.scans[k].points.front().doppler, all.scans[k].points.front().doppler);
    }
  }
  options.radar.points_min = options.radar.points_max + 1;
  EXPECT_THROW(simulate(motion, options), std::invalid_argument);
}

TEST(RadarModel, DopplerHasItsNoise) {
  // Same seed with and without errors of the points, so the same reflectors: compare point by point is not
  // possible (noise draws shift), so look at the Doppler residuals at rest instead, where truth is zero.
  SimulationOptions options;
  options.radar.doppler_step = 0.0;
  options.radar.ghost_share = 0.0;
  options.radar.moving_share = 0.0;
  options.radar.doppler_noise = 0.05;
  double square = 0.0;
  double count = 0.0;
  for (const SimulatedScan& scan : simulate(builtIn("easy"), options).scans) {
    if (scan.measured - options.start > 12.0) continue;
    for (const SimulatedPoint& point : scan.points) {
      square += point.doppler * point.doppler;
      count += 1.0;
    }
  }
  ASSERT_GT(count, 4000.0);
  EXPECT_NEAR(std::sqrt(square / count), 0.05, 5.0 * 0.05 / std::sqrt(2.0 * count));
}

TEST(RadarModel, AngularNoiseBendsDirectionsByItsSigma) {
  SimulationOptions options = withoutErrors();
  options.radar.azimuth_noise = 2.0;
  double square_azimuth = 0.0, square_elevation = 0.0;
  const SensorData exact = simulate(builtIn("difficult"), withoutErrors());
  const SensorData noisy = simulate(builtIn("difficult"), options);
  ASSERT_EQ(exact.scans.size(), noisy.scans.size());
  double count = 0.0;
  for (std::size_t k = 0; k < exact.scans.size(); ++k) {
    // All echoes of a scan are chosen before noise is drawn, and the draws are the same whatever their sigma.
    ASSERT_EQ(exact.scans[k].points.size(), noisy.scans[k].points.size());
    for (std::size_t i = 0; i < exact.scans[k].points.size(); ++i) {
      const Eigen::Vector3d& a = exact.scans[k].points[i].position_R;
      const Eigen::Vector3d& b = noisy.scans[k].points[i].position_R;
      square_azimuth += std::pow(std::atan2(b.x(), b.y()) - std::atan2(a.x(), a.y()), 2);
      square_elevation += std::pow(std::asin(b.z() / b.norm()) - std::asin(a.z() / a.norm()), 2);
      count += 1.0;
    }
  }
  ASSERT_GT(count, 30000.0);
  const double degree = 3.141592653589793 / 180.0;
  EXPECT_NEAR(std::sqrt(square_azimuth / count), 2.0 * degree, 0.02 * 2.0 * degree);
  EXPECT_LT(std::sqrt(square_elevation / count), 1e-9);
}

TEST(RadarModel, StaysInTheFieldOfViewAndRange) {
  SimulationOptions options = withoutErrors();
  options.radar.fov_azimuth = 40.0;
  options.radar.fov_elevation = 20.0;
  options.radar.min_range = 1.0;
  options.radar.max_range = 6.0;
  const double degree = 3.141592653589793 / 180.0;
  std::size_t count = 0;
  for (const SimulatedScan& scan : simulate(builtIn("easy"), options).scans) {
    for (const SimulatedPoint& point : scan.points) {
      const Eigen::Vector3d& p = point.position_R;
      ASSERT_GE(p.norm(), 1.0 - 1e-9);
      ASSERT_LE(p.norm(), 6.0 + 1e-9);
      ASSERT_LE(std::abs(std::atan2(p.x(), p.y())), 40.0 * degree + 1e-9);
      ASSERT_LE(std::abs(std::atan2(p.z(), std::hypot(p.x(), p.y()))), 20.0 * degree + 1e-9);
      ++count;
    }
  }
  EXPECT_GT(count, 5000u);
}

}  // namespace
}  // namespace rio_t::simulation
