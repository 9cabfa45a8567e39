// Several radars on one rig, and mountings that are estimated, through the whole pipeline.
#include <gtest/gtest.h>

#include <cmath>

#include "rio_t/core/so3.h"
#include "simulated_run.h"

namespace rio_t {
namespace {

constexpr double kDegree = M_PI / 180.0;

/// Looks forward (yaw 0), and turned about the vertical and up. R: right, forward, up; I: forward, left, up.
Eigen::Quaterniond looking(double yaw_deg, double pitch_deg) {
  const Eigen::AngleAxisd yaw(yaw_deg * kDegree, Eigen::Vector3d::UnitZ());
  const Eigen::AngleAxisd up(-pitch_deg * kDegree, Eigen::Vector3d::UnitY());
  const Eigen::AngleAxisd forward(-0.5 * M_PI, Eigen::Vector3d::UnitZ());  // y of R is x of I
  return Eigen::Quaterniond(yaw * up * forward);
}

/// Two radars, left and right, that are told as they are.
SimulatedRun pair(const std::string& motion, std::uint64_t seed, double duration) {
  SimulatedRun run(motion, seed, duration, 5.0);
  for (const auto& [name, side] : {std::pair{"left", 1.0}, std::pair{"right", -1.0}}) {
    simulation::RadarSetup& radar = run.setup.radars[name];
    radar.T_IR = {{0.1, 0.1 * side, 0.02}, looking(40.0 * side, 0.0)};
    radar.time_offset.constant = side > 0.0 ? -0.009 : 0.040;
    RadarOptions told;
    told.name = name;
    told.T_IR = radar.T_IR;
    run.options.radars.push_back(told);
  }
  return run;
}

TEST(TwoRadars, EachHasItsOffset) {
  for (const std::uint64_t seed : {1, 2}) {
    SimulatedRun run = pair("difficult", seed, 60.0);
    run.run();
    for (const auto& [radar, truth] : {std::pair{0, -0.009}, std::pair{1, 0.040}}) {
      const ScanResult& last = run.last(radar);
      printf("seed %d radar %d offset %.3f ms sigma %.3f\n", int(seed), radar, 1e3*last.time_offset, 1e3*last.time_offset_sigma);
      EXPECT_NEAR(last.time_offset, truth, 5e-4) << "radar " << radar << ", seed " << seed;
      EXPECT_LT(std::abs(last.time_offset - truth), 2.6 * last.time_offset_sigma);
    }
    printf("ate %.3f\n", run.rms(5,60,[&](const NavigationState& s){return run.positionError(s);}));
  }
}

TEST(TwoRadars, Extrinsics) {
  for (const std::uint64_t seed : {1, 2}) {
    SimulatedRun run = pair("difficult", seed, 60.0);
    run.options.smoother.estimate_extrinsics = EstimateExtrinsics::kPose;
    run.options.radars[0].T_IR.q_IR = so3::exp({0.05,-0.04,0.06})*run.options.radars[0].T_IR.q_IR;
    run.options.radars[1].T_IR.l_I.x() += 0.05;
    run.run();
    for (const auto& [radar, name] : {std::pair{0, "left"}, std::pair{1, "right"}}) {
      const ScanResult& last = run.last(radar);
      const Eigen::Vector3d e = so3::log(last.T_IR.q_IR*run.setup.radars[name].T_IR.q_IR.conjugate())/kDegree;
      const Eigen::Vector3d l = last.T_IR.l_I-run.setup.radars[name].T_IR.l_I;
      const Eigen::VectorXd s = last.T_IR_covariance.diagonal().cwiseSqrt();
      printf("seed %d radar %d offset %.3f ms sigma %.3f turn err %.3f %.3f %.3f (%.3f %.3f %.3f) lever %.3f %.3f %.3f (%.3f %.3f %.3f)\n", int(seed), radar, 1e3*last.time_offset, 1e3*last.time_offset_sigma, e[0],e[1],e[2],s[3]/kDegree,s[4]/kDegree,s[5]/kDegree,l[0],l[1],l[2],s[0],s[1],s[2]);
    }
    printf("ate %.3f\n", run.rms(5,60,[&](const NavigationState& s){return run.positionError(s);}));
  }
}

}  // namespace
}  // namespace rio_t
