// The search for the mounting on simulated motions: errors against its sigmas.
#include "rio_t/inspection/mounting_search.h"

#include <gtest/gtest.h>

#include <cmath>

#include "rio_t/core/angle.h"
#include "rio_t/core/so3.h"
#include "rio_t/inspection/cloud_report.h"
#include "rio_t/inspection/imu_report.h"
#include "rio_t/radar/mounting.h"
#include "simulated_run.h"

namespace rio_t {
namespace {

struct Searched {
  MountingSearch search;
  DopplerSign sign;
  RangeRatio ratio;
  Eigen::Vector3d error = Eigen::Vector3d::Zero();  // [rad] about the axes of I
  double lever_arm_nees = 0.0;                      // mean over the axes
};

/// `doppler_factor`: what the driver makes of the Doppler.
Searched searchOn(const std::string& motion, std::uint64_t seed, double doppler_factor,
                  const Extrinsics& T_IR, bool measures_elevation = true) {
  SimulatedRun simulated(motion, seed, 60.0, 5.0);
  simulated.setup.T_IR = T_IR;
  simulated.setup.time_offset.constant = 0.04;
  simulated.setup.radar.measures_elevation = measures_elevation;
  if (!measures_elevation) simulated.setup.radar.fov_elevation = 5.0;
  const simulation::SensorData data = simulation::simulate(simulated.motion, simulated.setup);
  std::vector<RadarScan> scans;
  for (const simulation::SimulatedScan& from : data.scans) {
    if (!from.delivered) continue;
    scans.push_back(SimulatedRun::scan(from));
    for (RadarPoint& point : scans.back().points) point.doppler *= doppler_factor;
  }
  const InertialTrack track(data.imu.samples, Eigen::Vector3d::Zero());
  Searched result;
  result.sign = dopplerSignFromRanges(scans, track);
  result.ratio = rangeRatio(scans, track);
  MountingSearchOptions options;
  options.sign_from_ranges = result.sign.sign;
  options.up_I = Eigen::Vector3d::UnitZ();
  result.search = searchMounting(radarVelocities(scans).velocities, track, options);
  result.error = so3::log((result.search.q_IR * T_IR.q_IR.conjugate()).normalized());
  const Eigen::Vector3d apart = result.search.lever_arm_I - T_IR.l_I;
  result.lever_arm_nees = apart.cwiseQuotient(result.search.lever_arm_sigma).squaredNorm() / 3.0;
  return result;
}

Extrinsics tilted(std::uint64_t seed) {
  const double k = static_cast<double>(seed);
  return {{0.1, -0.05, 0.08},
          so3::exp({1.3 * std::sin(k), 2.0 * std::cos(2.0 * k), 2.5 * std::sin(3.0 * k)})};
}

TEST(MountingSearch, TheLeverArmIsWithinItsSigma) {
  for (const char* motion : {"medium", "ground_vehicle"}) {
    double nees = 0.0;
    constexpr int kSeeds = 6;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed)
      nees += searchOn(motion, seed, 1.0, tilted(seed)).lever_arm_nees / kSeeds;
    std::printf("%s: NEES %.2f\n", motion, nees);
    EXPECT_LT(nees, 2.0) << motion;
  }
}

TEST(MountingSearch, AnyMountingAndSignIsFoundWithinItsSigma) {
  double sum = 0.0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const int sign = seed % 2 == 0 ? -1 : 1;
    const Searched found = searchOn(seed % 3 == 0 ? "drone" : "medium", seed, sign, tilted(seed));
    ASSERT_TRUE(found.search.enough);
    EXPECT_EQ(found.search.sign, sign) << seed;
    EXPECT_FALSE(found.search.mirrored) << seed;
    EXPECT_GT(found.search.sign_significance, 25.0) << seed;
    EXPECT_LT(found.error.norm(), 6.0 * kDegree) << seed;
    EXPECT_NEAR(found.search.offset, 0.04, 4.0 * found.search.offset_sigma) << seed;
    EXPECT_LT(found.search.offset_sigma, 0.05) << seed;
    for (int k = 0; k < 3; ++k) {
      EXPECT_LT(found.search.rotation_sigma[k], 0.15) << seed;
      sum += std::pow(found.error[k] / found.search.rotation_sigma[k], 2);
      ++count;
    }
  }
  // Coarse: it may be too careful, but not too sure.
  EXPECT_LT(sum / count, 1.5);
}

TEST(MountingSearch, AVehicleThatOnlyDrivesAheadSaysThatItsRollIsNotObserved) {
  const Searched found = searchOn("ground_vehicle", 1, 1, {{0.0, 0.0, 0.0}, rotationOf({0.3, 0.2, 0.0})});
  EXPECT_GT(found.search.rotation_sigma.maxCoeff(), 0.3);
  EXPECT_LT(found.search.rotation_sigma.minCoeff(), 0.1);
  // An upright radar is assumed, and this one is.
  EXPECT_LT(found.error.norm(), 15.0 * kDegree);
}

/// The noise of the elevation, which is the largest, must not count as evidence of where the radar looks.
TEST(MountingSearch, AVehicleWhoseRadarLooksDownSaysThatItsTurnIsNotObserved) {
  for (const std::uint64_t seed : {1, 3, 4, 5}) {
    const Searched found =
        searchOn("ground_vehicle", seed, 1, {{0.0, 0.0, 0.0}, rotationOf({0.0, -M_PI / 2, 0.0})});
    ASSERT_TRUE(found.search.enough);
    EXPECT_GT(found.search.rotation_sigma.maxCoeff(), 0.3) << seed << ": " << found.error.transpose();
  }
}

TEST(MountingSearch, ARadarWithoutElevationShowsWhereItLooks) {
  const Searched found =
      searchOn("ground_vehicle", 1, 1, {{0.0, 0.0, 0.0}, rotationOf({0.5, 0.0, 0.0})}, false);
  ASSERT_TRUE(found.search.enough);
  EXPECT_LT(std::abs(found.error.z()), 3.0 * kDegree);
  // The limit of check_bag (kObservedTurn). What such a radar does not see counts as noise in all directions.
  EXPECT_LT(found.search.rotation_sigma.z(), 0.3);
  EXPECT_GT(found.search.rotation_sigma.x(), 0.3) << found.error.transpose();
}

TEST(MountingSearch, RestSaysNothing) {
  std::vector<RadarVelocity> rest;
  std::vector<ImuMeasurement> imu;
  for (int i = 0; i < 4000; ++i) {
    ImuMeasurement sample;
    sample.time = Time::fromSeconds(1000.0 + 0.005 * i);
    sample.acceleration = {0.0, 0.0, 9.81};
    imu.push_back(sample);
    if (i % 20 == 0)
      rest.push_back({sample.time, Eigen::Vector3d::Zero(), 1e-3 * Eigen::Matrix3d::Identity()});
  }
  EXPECT_FALSE(searchMounting(rest, InertialTrack(imu, Eigen::Vector3d::Zero()), {}).enough);
}

TEST(MountingSearch, The24TurnsAreRotations) {
  for (const Eigen::Matrix3d& turn : axisTurns()) {
    EXPECT_NEAR(turn.determinant(), 1.0, 1e-12);
    EXPECT_LT((turn * turn.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
    EXPECT_EQ(std::count_if(axisTurns().begin(), axisTurns().end(),
                            [&](const Eigen::Matrix3d& other) { return (turn - other).norm() < 1e-9; }),
              1);
  }
}

TEST(DopplerSignFromRanges, IsThatOfTheDriver) {
  EXPECT_EQ(searchOn("drone", 1, 1, {}).sign.sign, 1);
  EXPECT_EQ(searchOn("drone", 1, -1, {}).sign.sign, -1);
}

TEST(RangeRatio, IsThatOfTheDoppler) {
  for (const char* motion : {"drone", "medium", "ground_vehicle"}) {
    for (const double factor : {0.5, 1.0, 2.0, -2.0, 3.6, 100.0}) {
      const RangeRatio found = searchOn(motion, 1, factor, {}).ratio;
      ASSERT_GT(found.ratio, 0.0) << motion << ", " << factor;
      const double error = std::log(found.ratio * std::abs(factor));
      EXPECT_LT(std::abs(error), 3.0 * found.log_sigma) << motion << ", " << factor << ": " << found.ratio;
      EXPECT_LT(found.log_sigma, 0.2) << motion << ", " << factor;
    }
  }
}

TEST(RangeRatio, RestShowsNothing) {
  RadarScan scan;
  scan.points.push_back({{0.0, 5.0, 0.0}, 0.0, 20.0});
  std::vector<RadarScan> scans;
  std::vector<ImuMeasurement> imu;
  for (int i = 0; i < 100; ++i) {
    scan.stamp = Time() + 0.1 * i;
    scans.push_back(scan);
    ImuMeasurement sample;
    sample.time = scan.stamp;
    imu.push_back(sample);
  }
  EXPECT_EQ(rangeRatio(scans, InertialTrack(imu, Eigen::Vector3d::Zero())).ratio, 0.0);
}

}  // namespace
}  // namespace rio_t
