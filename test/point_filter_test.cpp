#include "rio_t/radar/point_filter.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace rio_t {
namespace {

TEST(PointFilter, TheFirstFailedTestIsNamed) {
  const EgoVelocityOptions o;
  const auto judge = [&](const Eigen::Vector3d& p, double snr) {
    return PointFilter(o).judge({p, 0.0, snr});
  };
  EXPECT_EQ(judge({0.0, 5.0, 0.0}, 10.0), PointVerdict::kKept);
  EXPECT_EQ(judge({0.0, 0.0, 0.0}, 10.0), PointVerdict::kNoMeasurement);
  EXPECT_EQ(PointFilter(o).judge({{0.0, 5.0, 0.0}, -999.0, 10.0}), PointVerdict::kNoMeasurement);
  EXPECT_EQ(judge({0.0, 0.1, 0.0}, 10.0), PointVerdict::kTooNear);
  EXPECT_EQ(judge({0.0, 500.0, 0.0}, 0.0), PointVerdict::kTooFar);
  EXPECT_EQ(judge({0.0, 5.0, 0.0}, 0.0), PointVerdict::kTooWeak);
  EXPECT_EQ(judge({0.1, -5.0, 0.0}, 10.0), PointVerdict::kBesideView);
  EgoVelocityOptions flat;
  flat.max_elevation = 0.1;
  EXPECT_EQ(PointFilter(flat).judge({{0.0, 5.0, -3.0}, 0.0, 10.0}), PointVerdict::kAboveView);
  EXPECT_EQ(PointFilter(o).judge({{0.0, 5.0, 0.0}, 0.0, 10.0, true}), PointVerdict::kAmbiguous);
}

/// Which of these points are ambiguous, as a string of zeros and ones.
std::string ambiguous(std::vector<RadarPoint> points) {
  markAmbiguous(points);
  std::string marks;
  for (const RadarPoint& p : points) marks += p.is_ambiguous ? '1' : '0';
  return marks;
}

TEST(PointFilter, OneEchoAtSeveralDirectionsIsAmbiguous) {
  const Eigen::Vector3d here(0.0, 3.0, 4.0), there(3.0, 4.0, 0.0);  // both at 5 m
  const Eigen::Vector3d rounded = there + Eigen::Vector3d(0.0, 0.001, 0.0);
  const Eigen::Vector3d next_bin = 1.01 * there;
  EXPECT_EQ(ambiguous({}), "");
  EXPECT_EQ(ambiguous({{here, 0.5, 20.0}}), "0");
  EXPECT_EQ(ambiguous({{here, 0.5, 20.0}, {there, 0.5, 20.0}}), "11");
  EXPECT_EQ(ambiguous({{here, 0.5, 20.0}, {here, 0.1, 9.0}, {rounded, 0.5, 20.0}}), "101");
  EXPECT_EQ(ambiguous({{here, 0.5, 20.0}, {there, 0.6, 20.0}, {here, 0.1, 9.0}}), "000") << "another Doppler";
  EXPECT_EQ(ambiguous({{here, 0.5, 20.0}, {there, 0.5, 20.1}, {here, 0.1, 9.0}}), "000") << "another SNR";
  EXPECT_EQ(ambiguous({{here, 0.5, 20.0}, {next_bin, 0.5, 20.0}, {here, 0.1, 9.0}}), "000")
      << "another range";
  EXPECT_EQ(ambiguous({{here, 0.5, 20.0}, {there, 0.5, 20.0}, {here, 0.1, 20.0}}), "000") << "no SNR";
}

}  // namespace
}  // namespace rio_t
