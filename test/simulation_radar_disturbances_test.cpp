// Ghosts, persons, lost scans and silences of the simulated radar.
#include <gtest/gtest.h>

#include <Eigen/Dense>
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

// Share of the points that do not fit the true velocity.
double shareOfMisfits(const std::string& motion, const SimulationOptions& options) {
  double misfits = 0.0, all = 0.0;
  for (const SimulatedScan& scan : simulate(builtIn(motion), options).scans) {
    for (const SimulatedPoint& point : scan.points) {
      misfits += std::abs(point.doppler + point.position_R.normalized().dot(scan.v_R)) > 1e-6 ? 1.0 : 0.0;
      all += 1.0;
    }
  }
  return misfits / all;
}

TEST(RadarModel, GhostsComeInTheirShare) {
  SimulationOptions options = withoutErrors();
  EXPECT_EQ(shareOfMisfits("gym_loop", options), 0.0);
  options.radar.ghost_share = 0.1;
  // 43000 points: sigma of the share is 0.0014.
  EXPECT_NEAR(shareOfMisfits("gym_loop", options), 0.1, 0.007);
}

TEST(RadarModel, ABurstOfGhostsIsAllGhostsAndLeavesTheOtherScansAlone) {
  SimulationOptions options;
  const Motion motion = builtIn("medium", 1, 40.0);
  const SensorData calm = simulate(motion, options);
  options.radar.ghost_bursts = {{20.0, 2.0}, {30.0, 0.5}};
  const SensorData disturbed = simulate(motion, options);
  ASSERT_EQ(disturbed.scans.size(), calm.scans.size());
  std::size_t ghosts = 0, hits = 0;
  for (std::size_t k = 0; k < calm.scans.size(); ++k) {
    const SimulatedScan& scan = disturbed.scans[k];
    const double t = scan.stamp - options.start;
    ASSERT_EQ(scan.points.size(), calm.scans[k].points.size()) << t;
    const bool burst = (t >= 20.0 && t < 22.0) || (t >= 30.0 && t < 30.5);
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      const SimulatedPoint& point = scan.points[i];
      if (!burst) {
        ASSERT_EQ(point.position_R, calm.scans[k].points[i].position_R) << t;
        continue;
      }
      ++ghosts;
      hits += std::abs(point.doppler + point.position_R.normalized().dot(scan.v_R)) < 0.125 ? 1 : 0;
    }
  }
  // Dopplers of ghosts are even over 5 m/s: a band of 0.25 m/s holds 5 % of them, of some thousand points.
  ASSERT_GT(ghosts, 800u);
  EXPECT_NEAR(static_cast<double>(hits) / static_cast<double>(ghosts), 0.05, 0.04);
}

TEST(RadarModel, AmbiguousPointsHaveASecondDirectionAndLeaveTheOthersAlone) {
  SimulationOptions options;
  const Motion motion = builtIn("medium", 1, 40.0);
  const SensorData clean = simulate(motion, options);
  options.radar.ambiguous_share = 0.15;
  const SensorData ambiguous = simulate(motion, options);
  std::size_t all = 0, second = 0;
  for (std::size_t k = 0; k < clean.scans.size(); ++k) {
    const std::vector<SimulatedPoint>& points = ambiguous.scans[k].points;
    const std::size_t echoes = clean.scans[k].points.size();
    ASSERT_GE(points.size(), echoes);
    for (std::size_t i = 0; i < echoes; ++i)
      ASSERT_EQ(points[i].position_R, clean.scans[k].points[i].position_R);
    for (std::size_t i = echoes; i < points.size(); ++i) {
      const SimulatedPoint& point = points[i];
      EXPECT_TRUE(std::any_of(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(echoes),
                              [&](const SimulatedPoint& echo) {
                                return echo.doppler == point.doppler && echo.snr_db == point.snr_db &&
                                       std::abs(echo.position_R.norm() - point.position_R.norm()) < 1e-9 &&
                                       (echo.position_R - point.position_R).norm() > 1e-3;
                              }));
    }
    all += echoes;
    second += points.size() - echoes;
  }
  // 17000 points: sigma of the share is 0.003.
  EXPECT_NEAR(static_cast<double>(second) / static_cast<double>(all), 0.15, 0.015);
}

TEST(RadarModel, WithoutErrorsBlackoutsAndBurstsOfGhostsStay) {
  SimulationOptions options;
  options.radar.blackouts = {{20.0, 1.0}};
  options.radar.ghost_bursts = {{25.0, 1.0}};
  options.radar.removeErrors();
  for (const SimulatedScan& scan : simulate(builtIn("medium", 1, 40.0), options).scans) {
    const double t = scan.stamp - options.start;
    ASSERT_EQ(scan.delivered, t < 20.0 || t >= 21.0) << t;
    const bool fits = std::all_of(scan.points.begin(), scan.points.end(), [&](const SimulatedPoint& p) {
      return std::abs(p.doppler + p.position_R.normalized().dot(scan.v_R)) < 1e-6;
    });
    EXPECT_EQ(fits, t < 25.0 || t >= 26.0) << t;
  }
}

TEST(RadarModel, APersonWalksThroughTheViewForItsShareOfTheTime) {
  SimulationOptions options = withoutErrors();
  options.radar.moving_share = 0.3;
  const Motion motion = builtIn("constant_speed", 1, 1000.0);
  std::size_t disturbed = 0;
  const SensorData data = simulate(motion, options);
  for (const SimulatedScan& scan : data.scans) {
    const bool moving = std::any_of(scan.points.begin(), scan.points.end(), [&](const SimulatedPoint& p) {
      return std::abs(p.doppler + p.position_R.normalized().dot(scan.v_R)) > 1e-6;
    });
    disturbed += moving ? 1 : 0;
  }
  // The person may leave the view before the visit ends, so somewhat less than the share is seen.
  const double share = static_cast<double>(disturbed) / static_cast<double>(data.scans.size());
  EXPECT_GT(share, 0.2);
  EXPECT_LT(share, 0.36);
}

// Persons in a scan without errors. Theirs are the first points, those of one after those of the other, and
// all of one share a horizontal velocity.
int personsIn(const SimulatedScan& scan, const Eigen::Quaterniond& q_WR) {
  int persons = 0;
  std::vector<Eigen::Vector2d> directions;  // of the person that is being read
  std::vector<double> speeds;               // away from the radar's place
  for (const SimulatedPoint& point : scan.points) {
    const Eigen::Vector3d direction_R = point.position_R.normalized();
    const double speed = point.doppler + direction_R.dot(scan.v_R);
    if (std::abs(speed) < 1e-6) break;  // the room begins
    directions.emplace_back((q_WR * direction_R).head<2>());
    speeds.push_back(speed);
    Eigen::MatrixXd H(static_cast<Eigen::Index>(speeds.size()), 2);
    for (Eigen::Index i = 0; i < H.rows(); ++i)
      H.row(i) = directions[static_cast<std::size_t>(i)].transpose();
    const Eigen::Map<const Eigen::VectorXd> y(speeds.data(), H.rows());
    const bool fits = (H * H.colPivHouseholderQr().solve(y) - y).norm() < 1e-6;
    if (fits && speeds.size() > 1) continue;
    ++persons;
    directions.erase(directions.begin(), directions.end() - 1);
    speeds.erase(speeds.begin(), speeds.end() - 1);
  }
  return persons;
}

TEST(RadarModel, ACrowdIsInViewAtOnceAndOnTheSameVisits) {
  SimulationOptions options = withoutErrors();
  options.radar.moving_share = 0.3;
  options.radar.points_mean = 150.0;
  options.radar.points_max = 200;
  const Motion motion = makeMotion({"constant_speed", 1, 200.0, MotionRestOptions{}, 0.2});
  const SensorData alone = simulate(motion, options);
  for (const int crowd : {1, 6}) {
    options.radar.crowd = crowd;
    const SensorData data = simulate(motion, options);
    ASSERT_EQ(data.scans.size(), alone.scans.size());
    int visits = 0, before = 0;
    double disturbed = 0.0;
    for (std::size_t k = 0; k < data.scans.size(); ++k) {
      const int persons = personsIn(data.scans[k], options.T_IR.q_IR);  // the IMU is level all the way
      const bool visited = personsIn(alone.scans[k], options.T_IR.q_IR) > 0;
      ASSERT_LE(persons, crowd) << k;
      // All persons are in view when a visit begins.
      if (before == 0 && visited) {
        EXPECT_EQ(persons, crowd) << k;
        ++visits;
      }
      disturbed += persons > 0 ? 1.0 : 0.0;
      before = persons;
    }
    EXPECT_GT(visits, 12);
    EXPECT_NEAR(disturbed / static_cast<double>(data.scans.size()), 0.3, crowd > 1 ? 0.06 : 0.1);
  }
}

TEST(RadarModel, ACrowdStaysWithinTheLimitOfPoints) {
  SimulationOptions options = withoutErrors();
  options.radar.moving_share = 0.5;
  options.radar.crowd = 20;
  std::size_t most = 0;
  for (const SimulatedScan& scan : simulate(builtIn("medium"), options).scans) {
    most = std::max(most, scan.points.size());
  }
  EXPECT_EQ(most, static_cast<std::size_t>(options.radar.points_max));
  options.radar.crowd = 0;
  EXPECT_THROW(simulate(builtIn("medium"), options), std::invalid_argument);
}

TEST(RadarModel, DropsScansInTheirShareAndLeavesTheOthersAlone) {
  SimulationOptions options;
  const Motion motion = builtIn("medium");
  const SensorData whole = simulate(motion, options);
  options.radar.dropout_share = 0.2;
  const SensorData holes = simulate(motion, options);
  ASSERT_EQ(whole.scans.size(), holes.scans.size());
  double lost = 0.0;
  for (std::size_t k = 0; k < whole.scans.size(); ++k) {
    EXPECT_EQ(holes.scans[k].seq, whole.scans[k].seq);
    if (!holes.scans[k].delivered) {
      lost += 1.0;
      EXPECT_TRUE(holes.scans[k].points.empty());
      continue;
    }
    ASSERT_EQ(whole.scans[k].points.size(), holes.scans[k].points.size());
    EXPECT_EQ(whole.scans[k].points.back().doppler, holes.scans[k].points.back().doppler);
  }
  // Sigma of the share over 900 scans is 0.013.
  EXPECT_NEAR(lost / static_cast<double>(whole.scans.size()), 0.2, 0.067);
}

TEST(RadarModel, BlackoutsAreSilentAndOnlyThey) {
  SimulationOptions options;
  options.radar.blackouts = {{20.0, 3.0}, {50.0, 0.5}};
  for (const SimulatedScan& scan : simulate(builtIn("medium"), options).scans) {
    const double t = scan.stamp - options.start;
    const bool silent = (t >= 20.0 && t < 23.0) || (t >= 50.0 && t < 50.5);
    EXPECT_EQ(scan.delivered, !silent) << t;
  }
}

}  // namespace
}  // namespace rio_t::simulation
