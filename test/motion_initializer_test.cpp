// The first state of a platform that never rests: against the truth of simulated sensors, for any mounting
// and offset.
#include "rio_t/odometry/motion_initializer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "rio_t/core/so3.h"
#include "rio_t/odometry/initializer.h"
#include "rio_t/odometry/options.h"
#include "rio_t/radar/ego_velocity.h"
#include "rio_t/simulation/motions.h"
#include "rio_t/simulation/simulation.h"

namespace rio_t {
namespace {

/// As RadarChannel does it: first the step, then the velocity.
EgoVelocity velocityOf(const RadarScan& scan, EgoVelocityEstimator& estimator) {
  estimator.observe(scan);
  return estimator.estimate(scan);
}

/// A rig on a simulated motion that starts at full speed.
struct Rig {
  Rig(const std::string& name, std::uint64_t seed, double offset,
      const Eigen::Quaterniond& q_mount = Eigen::Quaterniond::Identity(),
      const simulation::SimulationOptions& sensors = {})
      : q_BI(q_mount), motion(makeMotion(name, seed)), setup(sensors) {
    setup.seed = seed;
    setup.time_offset.constant = offset;
    data = simulation::simulate(motion, setup);
    options.radar.T_IR = setup.T_IR;
    options.init_mode = InitMode::kMotion;
    // The same sensors in a frame I' that is turned against I.
    for (ImuMeasurement& sample : data.imu.samples) {
      sample.angular_velocity = q_BI.conjugate() * sample.angular_velocity;
      sample.acceleration = q_BI.conjugate() * sample.acceleration;
    }
    options.radar.T_IR.q_IR = q_BI.conjugate() * options.radar.T_IR.q_IR;
    options.radar.T_IR.l_I = q_BI.conjugate() * options.radar.T_IR.l_I;
  }
  static simulation::Motion makeMotion(const std::string& name, std::uint64_t seed) {
    simulation::MotionRequest request;
    request.name = name;
    request.seed = seed;
    request.duration = 20.0;
    request.rest.static_start = 0.0;
    request.rest.static_end = 0.0;
    return simulation::makeMotion(request);
  }

  RadarScan scan(const simulation::SimulatedScan& from) const {
    RadarScan result;
    result.stamp = from.stamp;
    for (const simulation::SimulatedPoint& point : from.points)
      result.points.push_back({point.position_R, point.doppler, point.snr_db});
    return result;
  }

  /// Feeds everything in the order of the stamps from `begin` seconds on, until the state is found.
  std::optional<Initialization> run(MotionInitializer& initializer, double begin = 0.0,
                                    const PoseAnchor& anchor = PoseAnchor()) {
    EgoVelocityEstimator estimator(options.radar.ego_velocity);
    auto next = data.scans.begin();
    for (const ImuMeasurement& sample : data.imu.samples) {
      if (sample.time - setup.start < begin) continue;
      imu.add(sample);
      for (; next != data.scans.end() && next->stamp < sample.time; ++next) {
        if (next->stamp - setup.start > begin)
          initializer.add(next->stamp, velocityOf(scan(*next), estimator));
      }
      if (auto found = initializer.solve(imu, [&](Time) { return anchor; })) return found;
    }
    return std::nullopt;
  }

  /// Angle between the true and the estimated direction of gravity, in I [rad].
  double tiltError(const Initialization& found) const {
    const simulation::MotionState truth = motion.at(found.time - setup.start);
    const Eigen::Vector3d up_true = (truth.q_WI * q_BI).conjugate() * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d up = found.prior.x0.q_WI().conjugate() * Eigen::Vector3d::UnitZ();
    return std::atan2(up.cross(up_true).norm(), up.dot(up_true));
  }
  /// Error of the velocity in I [m/s].
  double velocityError(const Initialization& found) const {
    const simulation::MotionState truth = motion.at(found.time - setup.start);
    const StateBlock& x = found.prior.x0;
    return ((truth.q_WI * q_BI).conjugate() * truth.v_W - x.q_WI().conjugate() * x.v_W()).norm();
  }

  Eigen::Quaterniond q_BI;  ///< turns the mounted IMU frame into the simulation's
  simulation::Motion motion;
  simulation::SimulationOptions setup;
  simulation::SensorData data;
  OdometryOptions options;
  ImuBuffer imu;
};

Eigen::MatrixXd covarianceOf(const NodePrior& prior) {
  return (prior.root.J.transpose() * prior.root.J).inverse();
}

TEST(MotionInitializer, FindsTiltVelocityAndOffsetAndKnowsHowWell) {
  double tilt_squares = 0.0;
  double offset_squares = 0.0;
  int runs = 0;
  for (const char* name : {"start_in_motion", "difficult", "drone", "ground_vehicle"}) {
    for (const double offset : {-0.00925, 0.03, 0.1}) {
      for (const std::uint64_t seed : {1U, 2U, 3U}) {
        SCOPED_TRACE(name + std::string(", offset ") + std::to_string(offset) + ", seed " +
                     std::to_string(seed));
        Rig rig(name, seed, offset);
        MotionInitializer initializer(rig.options, rig.options.radar);
        const auto found = rig.run(initializer, 1.7);
        ASSERT_TRUE(found) << initializer.waitingFor().text;
        EXPECT_EQ(initializer.waitingFor().text, "");
        const Eigen::MatrixXd P = covarianceOf(found->prior);
        const double tilt = rig.tiltError(*found);
        const double tilt_variance = P(0, 0) + P(1, 1) + P(2, 2);  // all of it tilt, but 1e-6
        const double offset_error = found->prior.t_O0 - offset;
        tilt_squares += tilt * tilt / tilt_variance;
        offset_squares += offset_error * offset_error / P(StateBlock::kTangent, StateBlock::kTangent);
        ++runs;
        EXPECT_LT(tilt, 0.025);
        EXPECT_LT(rig.velocityError(*found), 0.25);
        if (std::string(name) == "difficult") {
          // Seen well in two seconds; the others accelerate too little for that.
          EXPECT_NEAR(offset_error, 0.0, 0.01);
          EXPECT_LT(rig.velocityError(*found), 0.08);
        }
      }
    }
  }
  // One would be perfect; the biases are drawn from half and a third of the sigmas that are reckoned with.
  EXPECT_LT(tilt_squares / runs, 1.0);
  EXPECT_GT(tilt_squares / runs, 0.1);
  EXPECT_LT(offset_squares / runs, 1.5);
  EXPECT_GT(offset_squares / runs, 0.3);
}

// A narrow view, with noise of directions and Dopplers that is two to three times what the options say.
TEST(MotionInitializer, VelocitiesThatScatterWidenItsSigmas) {
  simulation::SimulationOptions poor;
  poor.radar.rate = 50.0;
  poor.radar.points_mean = 20.0;
  poor.radar.fov_azimuth = 30.0;
  poor.radar.azimuth_noise = 5.0;
  poor.radar.doppler_noise = 0.1;
  poor.radar.doppler_step = 0.04;
  double squares = 0.0;
  int runs = 0;
  for (const char* name : {"start_in_motion", "difficult", "drone"}) {
    for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
      SCOPED_TRACE(name + std::string(", seed ") + std::to_string(seed));
      Rig rig(name, seed, 0.03, Eigen::Quaterniond::Identity(), poor);
      MotionInitializer initializer(rig.options, rig.options.radar);
      const auto found = rig.run(initializer, 1.7);
      ASSERT_TRUE(found) << initializer.waitingFor().text;
      const Eigen::Matrix3d P = covarianceOf(found->prior).block<3, 3>(StateBlock::kV, StateBlock::kV);
      const double error = rig.velocityError(*found);
      squares += error * error / P.trace();
      ++runs;
    }
  }
  EXPECT_LT(squares / runs, 1.0);
  EXPECT_GT(squares / runs, 0.2);
}

TEST(MotionInitializer, WorksForAnyMounting) {
  for (const Eigen::Vector3d& turn : {Eigen::Vector3d(M_PI, 0, 0), Eigen::Vector3d(0, 0.5 * M_PI, 0),
                                      Eigen::Vector3d(-0.5 * M_PI, 0.3, 2.0)}) {
    Rig rig("difficult", 4, 0.03, so3::exp(turn));
    MotionInitializer initializer(rig.options, rig.options.radar);
    const auto found = rig.run(initializer);
    ASSERT_TRUE(found) << initializer.waitingFor().text;
    EXPECT_LT(rig.tiltError(*found), 0.025);
    EXPECT_LT(rig.velocityError(*found), 0.08);
  }
}

TEST(MotionInitializer, KeepsHeadingAndPositionOfTheAnchor) {
  Rig rig("difficult", 5, 0.0);
  // A wrong tilt with a heading of its own.
  PoseAnchor anchor;
  anchor.q_WI = so3::exp({0.0, 0.0, 1.2}) * rig.motion.at(2.0).q_WI * so3::exp({0.3, -0.2, 0.0});
  anchor.p_W = Eigen::Vector3d(10.0, -3.0, 2.0);
  rig.options.smoother.prior_sigma_yaw = 0.2;
  rig.options.smoother.prior_sigma_position = 0.7;
  // A heading and a position that are wrong together.
  const Eigen::Vector4d together(0.3, 0.5, -0.2, 0.0);
  anchor.covariance = together * together.transpose() + 0.01 * Eigen::Matrix4d::Identity();
  MotionInitializer initializer(rig.options, rig.options.radar);
  const auto found = rig.run(initializer, 0.0, anchor);
  ASSERT_TRUE(found) << initializer.waitingFor().text;
  const StateBlock& x = found->prior.x0;
  EXPECT_LT(rig.tiltError(*found), 0.025);
  EXPECT_LT((x.p_W() - anchor.p_W).norm(), 1e-9);
  // The turn from the anchor is about a level axis: no heading is added.
  const Eigen::Vector3d turn_W = so3::log(x.q_WI() * anchor.q_WI.conjugate());
  EXPECT_GT(turn_W.norm(), 0.2);
  EXPECT_NEAR(turn_W.z(), 0.0, 0.01);
  const Eigen::MatrixXd P = covarianceOf(found->prior);
  const auto E = poseInW(x.q_WI());
  Eigen::Matrix4d expected = anchor.covariance;
  expected.diagonal() += Eigen::Vector4d(0.2, 0.7, 0.7, 0.7).cwiseAbs2();
  EXPECT_LT(
      (E * P.topLeftCorner<StateBlock::kTangent, StateBlock::kTangent>() * E.transpose() - expected).norm(),
      1e-3);
}

TEST(MotionInitializer, ATenthOfTheScansMayBeWrong) {
  Rig rig("difficult", 6, 0.03);
  for (std::size_t k = 3; k < rig.data.scans.size(); k += 10) {
    for (simulation::SimulatedPoint& point : rig.data.scans[k].points) point.doppler -= 2.0;
  }
  MotionInitializer initializer(rig.options, rig.options.radar);
  const auto found = rig.run(initializer);
  ASSERT_TRUE(found) << initializer.waitingFor().text;
  EXPECT_LT(rig.tiltError(*found), 0.025);
  EXPECT_LT(rig.velocityError(*found), 0.1);
}

TEST(MotionInitializer, WrongUnitsAndSignsAreToldAndNotStartedFrom) {
  for (const std::string fault : {"accelerometer in g", "gyro in deg/s", "Doppler sign", "extrinsics"}) {
    SCOPED_TRACE(fault);
    Rig rig("difficult", 7, 0.0);
    for (ImuMeasurement& sample : rig.data.imu.samples) {
      if (fault == "accelerometer in g") sample.acceleration /= 9.81;
      if (fault == "gyro in deg/s") sample.angular_velocity *= 180.0 / M_PI;
    }
    for (simulation::SimulatedScan& scan : rig.data.scans) {
      for (simulation::SimulatedPoint& point : scan.points)
        if (fault == "Doppler sign") point.doppler = -point.doppler;
    }
    if (fault == "extrinsics")
      rig.options.radar.T_IR.q_IR = rig.options.radar.T_IR.q_IR * so3::exp({0.0, 0.0, 0.5 * M_PI});
    MotionInitializer initializer(rig.options, rig.options.radar);
    EXPECT_FALSE(rig.run(initializer));
    EXPECT_EQ(initializer.waitingFor().obstacle, StartObstacle::kContradiction)
        << initializer.waitingFor().text;
  }
}

TEST(MotionInitializer, DoesNotCountOnWhatBridgesAGapOfTheImu) {
  Rig rig("start_in_motion", 8, 0.0);
  const Time gap = rig.setup.start + 2.0;
  for (ImuMeasurement& sample : rig.data.imu.samples) sample.is_bridge = std::abs(sample.time - gap) < 0.2;
  MotionInitializer initializer(rig.options, rig.options.radar);
  const auto found = rig.run(initializer);
  ASSERT_TRUE(found) << initializer.waitingFor().text;
  EXPECT_GT(found->time - gap, 0.2 + 0.8 * rig.options.motion_initialization.window);
  EXPECT_LT(rig.tiltError(*found), 0.025);
}

TEST(MotionInitializer, SaysWhatItWaitsForAndBearsNonsense) {
  Rig rig("start_in_motion", 9, 0.0);
  MotionInitializer initializer(rig.options, rig.options.radar);
  EXPECT_FALSE(initializer.solve(rig.imu, [](Time) { return PoseAnchor(); }));  // no IMU at all
  EXPECT_NE(initializer.waitingFor().text.find("radar velocity"), std::string::npos);
  EgoVelocity none;
  none.status = EgoVelocityStatus::kTooFewPoints;
  EgoVelocity some;
  some.status = EgoVelocityStatus::kMoving;
  some.covariance.setIdentity();
  initializer.add(rig.setup.start + 1.0, none);
  initializer.add(Time(), some);
  for (int k = 0; k < 2000; ++k) initializer.add(rig.setup.start + 1e6 + k, some);
  const auto found = rig.run(initializer);
  ASSERT_TRUE(found) << initializer.waitingFor().text;
  EXPECT_LT(found->time - rig.setup.start, 3.0);
}

/// What the initialisation by `mode` starts from, and when [s].
std::optional<std::pair<InitializedFrom, double>> startBy(InitMode mode, Rig& rig, std::string* waiting_for) {
  rig.options.init_mode = mode;
  Initializer initializer(rig.options);
  EgoVelocityEstimator estimator(rig.options.radar.ego_velocity);
  auto next = rig.data.scans.begin();
  for (const ImuMeasurement& sample : rig.data.imu.samples) {
    rig.imu.add(sample);
    for (; next != rig.data.scans.end() && next->stamp < sample.time; ++next)
      initializer.addVelocity(0, next->stamp, velocityOf(rig.scan(*next), estimator));
    if (const auto found = initializer.add(sample, rig.imu))
      return std::make_pair(found->from, sample.time - rig.setup.start);
    *waiting_for = initializer.waitingFor().text;
  }
  return std::nullopt;
}

TEST(Initializer, StartsInMotionOnlyWhereToldTo) {
  std::string waiting_for;
  Rig never("start_in_motion", 10, 0.0);
  EXPECT_FALSE(startBy(InitMode::kStatic, never, &waiting_for));
  EXPECT_NE(waiting_for.find("rest"), std::string::npos) << waiting_for;
  Rig at_once("start_in_motion", 10, 0.0);
  const auto motion = startBy(InitMode::kMotion, at_once, &waiting_for);
  ASSERT_TRUE(motion);
  EXPECT_EQ(motion->first, InitializedFrom::kMotion);
  EXPECT_LT(motion->second, 3.0);
  EXPECT_NE(waiting_for.find("radar velocities in motion: "), std::string::npos) << waiting_for;
  Rig later("start_in_motion", 10, 0.0);
  const auto automatic = startBy(InitMode::kAuto, later, &waiting_for);
  ASSERT_TRUE(automatic);
  EXPECT_EQ(automatic->first, InitializedFrom::kMotion);
  EXPECT_NEAR(automatic->second, later.options.init_motion_after, 0.2);
}

/// The IMU of a platform at rest.
void still(Rig& rig) {
  for (ImuMeasurement& sample : rig.data.imu.samples) {
    sample.angular_velocity.setZero();
    sample.acceleration = {0.0, 0.0, 9.81};
  }
}

TEST(Initializer, PrefersRest) {
  // The longer one is still under way at rest when a start in motion would be due.
  for (const double duration : {3.0, 7.0}) {
    Rig rig("start_in_motion", 11, 0.0);
    rig.options.initialization.duration = duration;
    still(rig);
    for (simulation::SimulatedScan& scan : rig.data.scans) {
      for (simulation::SimulatedPoint& point : scan.points) point.doppler = 0.0;
    }
    std::string waiting_for;
    const auto found = startBy(InitMode::kAuto, rig, &waiting_for);
    ASSERT_TRUE(found) << waiting_for;
    EXPECT_EQ(found->first, InitializedFrom::kRest);
    EXPECT_NEAR(found->second, duration, 0.1);
  }
}

/// A crowd walks past in the first seconds. Then the platform is seen to rest.
TEST(Initializer, PrefersRestAfterACrowd) {
  Rig rig("start_in_motion", 11, 0.0);
  still(rig);
  for (simulation::SimulatedScan& scan : rig.data.scans) {
    const bool crowded = scan.stamp - rig.setup.start < 2.2;
    for (simulation::SimulatedPoint& point : scan.points)
      point.doppler = crowded ? -point.position_R.normalized().x() : 0.0;
  }
  std::string waiting_for;
  const auto found = startBy(InitMode::kAuto, rig, &waiting_for);
  ASSERT_TRUE(found) << waiting_for;
  EXPECT_EQ(found->first, InitializedFrom::kRest);
  EXPECT_NEAR(found->second, 6.0, 0.1);
}

TEST(Initializer, DoesNotTakeASmoothRideForRest) {
  Rig rig("ground_vehicle", 12, 0.0);
  still(rig);  // straight on, at constant speed
  std::string waiting_for;
  EXPECT_FALSE(startBy(InitMode::kStatic, rig, &waiting_for));
  EXPECT_NE(waiting_for.find("radar"), std::string::npos) << waiting_for;
}

// As after a jump of the IMU's clock.
TEST(Initializer, ASmoothRideMayStartAtOnce) {
  Rig rig("constant_speed", 12, 0.0);
  rig.options.init_motion_after = 0.0;
  std::string waiting_for;
  const auto found = startBy(InitMode::kAuto, rig, &waiting_for);
  ASSERT_TRUE(found) << waiting_for;
  EXPECT_EQ(found->first, InitializedFrom::kMotion);
}

}  // namespace
}  // namespace rio_t
