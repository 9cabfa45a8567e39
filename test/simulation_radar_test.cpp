#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "rio_t/simulation/radar_model.h"
#include "simulation_setup.h"

namespace rio_t::simulation {
namespace {

void expectExactEgoVelocity(const Motion& motion, const SimulationOptions& options) {
  expectExactEgoVelocity(motion, simulate(motion, options).scans, options, options.start);
}

TEST(RadarModel, NoiseFreeEgoVelocityIsTheTrueOneAtTheMeasurementTime) {
  SimulationOptions options = withoutErrors();
  for (const double offset : {0.0, -0.00925, 0.1}) {
    options.time_offset.constant = offset;
    expectExactEgoVelocity(builtIn("difficult"), options);
  }
}

TEST(RadarModel, NoiseFreeEgoVelocityIsTheTrueOneWithAnotherMounting) {
  SimulationOptions options = withoutErrors();
  options.T_IR.l_I = {0.5, -0.2, 0.3};
  options.T_IR.q_IR = Eigen::Quaterniond(0.8, -0.3, 0.4, 0.1).normalized();
  options.time_offset.constant = 0.03;
  expectExactEgoVelocity(builtIn("difficult", 2), options);
}

TEST(RadarModel, FollowsADriftingAndSteppingOffset) {
  SimulationOptions options = withoutErrors();
  options.time_offset.constant = 0.01;
  options.time_offset.drift = 2e-4;
  options.time_offset.steps = {{40.0, 0.03}, {60.0, -0.05}};
  EXPECT_NEAR(options.time_offset.at(39.9), 0.01 + 39.9 * 2e-4, 1e-12);
  EXPECT_NEAR(options.time_offset.at(40.0), 0.04 + 40.0 * 2e-4, 1e-12);
  EXPECT_NEAR(options.time_offset.at(60.0), -0.01 + 60.0 * 2e-4, 1e-12);
  expectExactEgoVelocity(builtIn("difficult"), options);
}

TEST(RadarModel, LeavesOutScansThatWouldHaveBeenMeasuredBeforeTheMotion) {
  SimulationOptions options = withoutErrors();
  options.time_offset.constant = 0.2;
  const SensorData data = simulate(builtIn("start_in_motion", 1, 30.0), options);
  ASSERT_FALSE(data.scans.empty());
  EXPECT_EQ(data.scans.front().seq, 0u);
  EXPECT_GE(data.scans.front().measured, options.start);
  EXPECT_NEAR(data.scans.front().stamp - options.start, 0.25, 1e-9);
}

TEST(RadarModel, FrameLengthAveragesTheDoppler) {
  const Motion motion = builtIn("difficult");
  SimulationOptions options = withoutErrors();
  const SensorData instant = simulate(motion, options);
  options.radar.frame_length = 0.2;
  const SensorData averaged = simulate(motion, options);
  double largest = 0.0;
  for (std::size_t k = 0; k < averaged.scans.size(); ++k) {
    const double t = averaged.scans[k].measured - options.start;
    if (t < 0.1 || t > motion.duration() - 0.1) continue;
    // The mean range rate is the change of range over the frame: needs no velocities at all. The points are
    // exact, so their place in W is known.
    const SimulatedPoint& point = averaged.scans[k].points.front();
    const auto radarAt = [&](double time) -> Eigen::Vector3d {
      const MotionState s = motion.at(time);
      return s.p_W + s.q_WI * options.T_IR.l_I;
    };
    const Eigen::Vector3d p_W = radarAt(t) + motion.at(t).q_WI * (options.T_IR.q_IR * point.position_R);
    const double mean = ((p_W - radarAt(t + 0.1)).norm() - (p_W - radarAt(t - 0.1)).norm()) / 0.2;
    ASSERT_NEAR(point.doppler, mean, 2e-4) << t;
    largest = std::max(largest, std::abs(point.doppler - instant.scans[k].points.front().doppler));
  }
  EXPECT_GT(largest, 0.02);  // the frame does matter in this motion
}

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

TEST(RadarModel, TheFirstTriggerSetsThePhase) {
  SimulationOptions options;
  options.radar.rate = 20.0;
  options.radar.first_trigger = 0.07;
  const std::vector<SimulatedScan> scans = simulate(builtIn("easy", 1, 30.0), options).scans;
  EXPECT_NEAR(scans[0].stamp - options.start, 0.07, 1e-9);
  EXPECT_NEAR(scans[100].stamp - options.start, 5.07, 1e-9);
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
      // Nobody has left the view yet when a visit begins.
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

TEST(RadarModel, ScansArriveWithTheLatency) {
  SimulationOptions options;
  options.radar.latency = 0.1;
  for (const SimulatedScan& scan : simulate(builtIn("easy", 1, 30.0), options).scans) {
    EXPECT_NEAR(scan.arrival - scan.stamp, 0.1, 1e-9);
  }
  options.radar.latency_sigma = 0.01;
  double square = 0.0, count = 0.0;
  for (const SimulatedScan& scan : simulate(builtIn("easy"), options).scans) {
    square += std::pow(scan.arrival - scan.stamp - 0.1, 2);
    count += 1.0;
  }
  EXPECT_NEAR(std::sqrt(square / count), 0.01, 5.0 * 0.01 / std::sqrt(2.0 * count));
}

TEST(RadarModel, RefusesOptionsOutOfRange) {
  const Motion motion = builtIn("easy", 1, 30.0);
  SimulationOptions options;
  options.radar.ghost_share = 1.5;
  EXPECT_THROW(simulate(motion, options), std::invalid_argument);
  options = SimulationOptions{};
  options.radar.rate = 0.0;
  EXPECT_THROW(simulate(motion, options), std::invalid_argument);
  options = SimulationOptions{};
  options.radar.first_trigger = -0.01;
  EXPECT_THROW(simulate(motion, options), std::invalid_argument);
  options = SimulationOptions{};
  options.imu.rate = -1.0;
  EXPECT_THROW(simulate(motion, options), std::invalid_argument);
}

}  // namespace
}  // namespace rio_t::simulation
