#pragma once

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "rio_t/core/so3.h"
#include "rio_t/simulation/motions.h"
#include "rio_t/simulation/simulation.h"

namespace rio_t::simulation {

/// A built-in motion; duration in s with rest, 0 = its own.
inline Motion builtIn(const std::string& name, std::uint64_t seed = 1, double duration = 0.0) {
  return makeMotion({name, seed, duration, MotionRestOptions{}});
}

inline SimulationOptions withoutErrors() {
  SimulationOptions options;
  options.imu.removeErrors();
  options.radar.removeErrors();
  return options;
}

/// Velocity of the radar in R [m/s]. Least squares over all points of a scan, without weights: exact for
/// exact points.
inline Eigen::Vector3d leastSquaresVelocity(const SimulatedScan& scan) {
  Eigen::MatrixXd H(static_cast<Eigen::Index>(scan.points.size()), 3);
  Eigen::VectorXd y(H.rows());
  for (Eigen::Index i = 0; i < H.rows(); ++i) {
    const SimulatedPoint& point = scan.points[static_cast<std::size_t>(i)];
    H.row(i) = -point.position_R.normalized().transpose();
    y[i] = point.doppler;
  }
  return H.colPivHouseholderQr().solve(y);
}

/// Truth in R [m/s] by the formula of the method notes, written out here again.
inline Eigen::Vector3d expectedVelocity(const MotionState& s, const Extrinsics& T_IR) {
  const Eigen::Matrix3d R_IW = s.q_WI.toRotationMatrix().transpose();
  const Eigen::Matrix3d R_RI = T_IR.q_IR.toRotationMatrix().transpose();
  return R_RI * (R_IW * s.v_W + so3::hat(s.omega_I) * T_IR.l_I);
}

/// That scans without errors show the offset and the mounting of `setup`.
inline void expectExactEgoVelocity(const Motion& motion, const std::vector<SimulatedScan>& scans,
                                   const RadarSetup& setup, Time start) {
  ASSERT_GT(scans.size(), 100u);
  for (const SimulatedScan& scan : scans) {
    const double stamp = scan.stamp - start;
    const double offset = setup.time_offset.at(stamp);
    EXPECT_NEAR(scan.time_offset, offset, 1e-9);
    const Eigen::Vector3d truth = expectedVelocity(motion.at(stamp - offset), setup.T_IR);
    ASSERT_LT((leastSquaresVelocity(scan) - truth).norm(), 1e-6) << "stamp " << stamp;
    ASSERT_LT((scan.v_R - truth).norm(), 1e-6) << "stamp " << stamp;
  }
}

/// Points of the scans that were delivered, fewest first.
inline std::vector<int> sortedCounts(const std::vector<SimulatedScan>& scans) {
  std::vector<int> counts;
  for (const SimulatedScan& scan : scans) {
    if (scan.delivered) counts.push_back(static_cast<int>(scan.points.size()));
  }
  std::sort(counts.begin(), counts.end());
  return counts;
}

}  // namespace rio_t::simulation
