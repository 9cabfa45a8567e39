// The fixed-lag smoother with one radar: a known motion is recovered, and the window keeps what it knew.
#include <gtest/gtest.h>

#include <cmath>

#include "radar_smoother.h"
#include "rio_t/core/so3.h"
#include "rio_t/smoother/fixed_lag_smoother.h"
#include "rio_t/smoother/node_prior.h"

namespace rio_t {
namespace {

class Smoother : public ::testing::Test {
 protected:
  static constexpr double kEnd = 4.0;

  explicit Smoother() : imu(motion.imu(0.0, kEnd + 0.5, 400.0)) {}

  RadarVelocityMeasurement measurement(double stamp, double t_O) const {
    return radarMeasurement(motion, stamp, t_O);
  }

  RadarSmoother make(const SmootherOptions& options, const CalibrationPrior& radar = {skewMounting()}) const {
    RadarSmoother smoother(options, radar, motion.g_W, imu);
    smoother.initialize(motion.time(0.5),
                        priorAtRest(options, ImuNoise(), motion.state(0.5), 9.81, 3.0, radar));
    return smoother;
  }

  SyntheticMotion motion;
  ImuBuffer imu;
};

double headingVariance(const RadarSmoother& smoother) {
  const Eigen::Vector3d up_I = smoother.newest().x.q_WI().conjugate() * Eigen::Vector3d::UnitZ();
  return up_I.dot(smoother.newestCovariance().topLeftCorner<3, 3>() * up_I);
}

TEST_F(Smoother, RecoversTheOffsetWithTheImuModel) {
  for (const double t_O : {-0.05, 0.0, 0.03, 0.12}) {
    SmootherOptions options;
    options.time_offset_model = TimeOffsetModel::kImu;
    RadarSmoother smoother = make(options);
    for (double stamp = 0.7; stamp < kEnd; stamp += 0.1) {
      smoother.add(measurement(stamp, t_O));
      smoother.optimize();
      smoother.marginalize();
    }
    EXPECT_NEAR(smoother.t_O(), t_O, 2e-4);
    const NodeEstimate newest = smoother.newest();
    const StateBlock truth = motion.state(newest.time - motion.start);
    EXPECT_LT((newest.x.p_W() - truth.p_W()).norm(), 5e-3);
    EXPECT_LT((newest.x.v_W() - truth.v_W()).norm(), 5e-3);
    EXPECT_LT(so3::log(newest.x.q_WI().conjugate() * truth.q_WI()).norm(), 5e-3);
  }
}

TEST_F(Smoother, TheWindowIsBoundedAndKeepsItsCertainty) {
  SmootherOptions options;
  RadarSmoother smoother = make(options);
  std::vector<NodeEstimate> left;
  for (double stamp = 0.7; stamp < kEnd; stamp += 0.1) {
    smoother.add(measurement(stamp, 0.0));
    smoother.optimize();
    for (const NodeEstimate& node : smoother.marginalize()) left.push_back(node);
    EXPECT_LE(smoother.newest().time - smoother.node(0).time, options.window + 1e-6);
  }
  EXPECT_GT(left.size(), 20u);
  for (std::size_t k = 1; k < left.size(); ++k) EXPECT_LT(left[k - 1].time, left[k].time);
  // Had states been dropped instead of marginalised, the position would be as unknown as a window leaves it.
  const Eigen::MatrixXd P = smoother.newestCovariance();
  EXPECT_GT(P(0, 0), 0.0);
  EXPECT_LT(std::sqrt(P(StateBlock::kP, StateBlock::kP)), 0.1);
}

TEST_F(Smoother, AShortWindowEqualsALongOneWhereTheProblemIsNearlyLinear) {
  SmootherOptions short_window, long_window;
  short_window.window = 0.3;
  long_window.window = 100.0;
  short_window.huber_threshold = long_window.huber_threshold = 0.0;
  RadarSmoother a = make(short_window), b = make(long_window);
  for (double stamp = 0.7; stamp < 2.5; stamp += 0.1) {
    for (RadarSmoother* smoother : {&a, &b}) {
      smoother->add(measurement(stamp, 0.004));
      smoother->optimize();
      smoother->marginalize();
    }
  }
  EXPECT_GT(b.size(), 15u);
  EXPECT_LT(a.size(), 6u);
  EXPECT_LT((a.newest().x.p_W() - b.newest().x.p_W()).norm(), 1e-3);
  EXPECT_NEAR(a.t_O(), b.t_O(), 2e-4);
  EXPECT_NEAR(std::log(a.newestCovariance()(15, 15) / b.newestCovariance()(15, 15)), 0.0, 0.1);
}

TEST_F(Smoother, APositionAndAHeadingThatAreHardlyKnownStaySo) {
  SmootherOptions options;
  options.prior_sigma_position = 1e5;  // beside an IMU factor that knows its change to micrometres
  options.prior_sigma_yaw = 1.0;
  options.prior_sigma_velocity = 1e3;  // a velocity that is known in W would tell the heading
  RadarSmoother smoother = make(options);
  for (double stamp = 0.7; stamp < kEnd; stamp += 0.02) {
    smoother.add(measurement(stamp, 0.03));
    smoother.optimize();
    smoother.marginalize();
  }
  EXPECT_NEAR(smoother.t_O(), 0.03, 2e-4);
  const Eigen::MatrixXd P = smoother.newestCovariance();
  EXPECT_NEAR(std::sqrt(P(StateBlock::kP, StateBlock::kP)), 1e5, 100.0);
  EXPECT_NEAR(std::sqrt(headingVariance(smoother)), 1.0, 1e-2);
  const Eigen::Vector3d v_W = smoother.newest().x.v_W();
  EXPECT_LT(std::sqrt(P(StateBlock::kV + 2, StateBlock::kV + 2)), 0.1);
  EXPECT_LT(std::sqrt(P(StateBlock::kV, StateBlock::kV)), 0.1 + v_W.norm());
}

TEST_F(Smoother, AHeadingThatIsLostStaysLost) {
  // For 0.1 s nobody knows how far the gyro turned: 0.5 rad^2. The platform turns on the spot: a velocity
  // before and after would tell the turn between them.
  motion.amplitude.setZero();
  ImuBuffer blind;
  motion.imu(0.0, kEnd + 0.5, 400.0)
      .forEachSample(motion.time(0.0), motion.time(kEnd + 0.5), [&](ImuMeasurement s) {
        if (s.time > motion.time(1.5) && s.time < motion.time(1.6)) s.unseen_gyro_variance = 0.5 / 0.1;
        blind.add(s);
      });
  SmootherOptions options;
  RadarSmoother smoother(options, {skewMounting()}, motion.g_W, blind);
  smoother.initialize(motion.time(0.5),
                      priorAtRest(options, ImuNoise(), motion.state(0.5), 9.81, 3.0, {skewMounting()}));
  double lost = 0.0;
  for (double stamp = 0.7; stamp < kEnd; stamp += 0.05) {
    smoother.add(measurement(stamp, 0.0));
    smoother.optimize();
    smoother.marginalize();
    if (stamp < 1.7) lost = headingVariance(smoother);
  }
  EXPECT_NEAR(lost, 0.5, 0.05);
  EXPECT_GT(headingVariance(smoother), 0.999 * lost);
}

TEST_F(Smoother, TheBiasesWalkWhenANodeLeaves) {
  // With a walk of 0.1 (rad/s)/sqrt(s) the prior forgets the biases whenever a node leaves.
  const auto sigmaOfGyroBias = [&](double walk) {
    SmootherOptions options;
    ImuNoise noise;
    noise.gyro_random_walk = walk;
    RadarSmoother smoother = make(options);
    smoother.states.setImuNoise(noise);
    double last = 0.0;
    for (double stamp = 0.7; stamp < kEnd; stamp += 0.1) {
      smoother.add(measurement(stamp, 0.0));
      smoother.optimize();
      last = smoother.newestCovariance()(StateBlock::kBg, StateBlock::kBg);
      smoother.marginalize();
    }
    return std::sqrt(last);
  };
  EXPECT_LT(sigmaOfGyroBias(1e-9), 1.5e-4);
  EXPECT_GT(sigmaOfGyroBias(0.1), 5e-3);
}

TEST_F(Smoother, ADriftWidensThePositionAlone) {
  SmootherOptions options;
  RadarSmoother smoother = make(options), drifted = make(options);
  for (double stamp = 0.7; stamp < kEnd; stamp += 0.1) {
    for (RadarSmoother* each : {&smoother, &drifted}) {
      if (each == &drifted && std::abs(stamp - 2.5) < 0.01) each->states.addDrift(4.0);
      each->add(measurement(stamp, 0.0));
      each->optimize();
      each->marginalize();
    }
  }
  Eigen::MatrixXd expected = smoother.newestCovariance();
  expected.diagonal().segment<3>(StateBlock::kP).array() += 4.0;
  EXPECT_LT((drifted.newestCovariance() - expected).norm(), 1e-6);
  EXPECT_LT((drifted.newest().x.p_W() - smoother.newest().x.p_W()).norm(), 1e-6);
}

TEST_F(Smoother, ALateScanIsInsertedAtItsTime) {
  SmootherOptions options;
  RadarSmoother in_order = make(options), late = make(options);
  for (const double stamp : {0.7, 0.8, 0.9, 1.0}) EXPECT_TRUE(in_order.add(measurement(stamp, 0.0)));
  for (const double stamp : {0.7, 0.9, 1.0, 0.8}) EXPECT_TRUE(late.add(measurement(stamp, 0.0)));
  for (int i = 0; i < 3; ++i) {
    in_order.optimize();
    late.optimize();
  }
  ASSERT_EQ(in_order.size(), late.size());
  for (std::size_t k = 0; k < late.size(); ++k) {
    EXPECT_EQ(late.node(k).time, in_order.node(k).time);
    EXPECT_LT(boxminus(late.node(k).x.data(), in_order.node(k).x.data()).norm(), 1e-6);
  }
  EXPECT_FALSE(late.add(measurement(0.3, 0.0)));
}

/// Two radars may run at the same time. An IMU factor over almost no time costs the position its digits.
TEST_F(Smoother, ScansAtTheSameTimeShareANode) {
  for (const TimeOffsetModel model : {TimeOffsetModel::kImu, TimeOffsetModel::kConstantAcceleration}) {
    SmootherOptions options;
    options.time_offset_model = model;
    RadarSmoother smoother = make(options);
    const Block* node = smoother.states.nodeAt(motion.time(1.0));
    EXPECT_EQ(smoother.states.nodeAt(motion.time(1.0001)), node);
    EXPECT_EQ(smoother.states.nodeAt(motion.time(0.9999)), node);
    EXPECT_NE(smoother.states.nodeAt(motion.time(1.01)), node);
  }
}

TEST_F(Smoother, ScansThatSayNothingOfTheOffsetLeaveIt) {
  SmootherOptions options;
  RadarSmoother smoother = make(options);
  for (double stamp = 0.7; stamp < kEnd; stamp += 0.1) {
    RadarVelocityMeasurement z = measurement(stamp, 0.0);
    z.linear_from_t_O = std::make_shared<const double>(smoother.t_O());
    z.offset_gain = 0.0;
    smoother.add(z);
    smoother.optimize();
    smoother.marginalize();
  }
  EXPECT_NEAR(smoother.t_O(), 0.0, 1e-9);
  const Eigen::MatrixXd P = smoother.newestCovariance();
  EXPECT_GE(std::sqrt(P(StateBlock::kTangent, StateBlock::kTangent)),
            CalibrationPrior().time_offset_sigma * (1.0 - 1e-9));
}

TEST_F(Smoother, WithoutEstimationTheOffsetStays) {
  SmootherOptions options;
  options.estimate_time_offset = false;
  RadarSmoother smoother = make(options, {skewMounting(), 0.01});
  for (double stamp = 0.7; stamp < kEnd; stamp += 0.1) {
    smoother.add(measurement(stamp, 0.03));
    smoother.optimize();
    smoother.marginalize();
  }
  EXPECT_DOUBLE_EQ(smoother.t_O(), 0.01);
}

TEST_F(Smoother, PredictsTheVelocityOfTheNextScan) {
  const SmootherOptions options;
  RadarSmoother smoother = make(options, {skewMounting(), 0.02, 0.001});
  const RadarVelocityMeasurement z = measurement(0.7, 0.02);
  const auto prior = smoother.predict(z.stamp);
  ASSERT_TRUE(prior);
  EXPECT_LT((prior->velocity.v_R - z.v_R).norm(), 2e-3);
  // An offset that is less known makes the prediction less certain, where the platform accelerates.
  const auto unsure = make(options, {skewMounting(), 0.02, 0.1}).predict(z.stamp);
  EXPECT_GT(unsure->velocity.covariance.trace(), 4.0 * prior->velocity.covariance.trace());
}

TEST_F(Smoother, PredictsLateScansFromTheNodeBeforeThem) {
  SmootherOptions options;
  RadarSmoother smoother = make(options);
  for (double stamp = 0.7; stamp < 1.3; stamp += 0.1) {
    smoother.add(measurement(stamp, 0.0));
    smoother.optimize();
  }
  const RadarVelocityMeasurement late = measurement(0.95, 0.0);
  const auto prediction = smoother.predict(late.stamp);
  ASSERT_TRUE(prediction);
  EXPECT_LT((prediction->velocity.v_R - late.v_R).norm(), 0.02);
  EXPECT_LT(std::sqrt(prediction->velocity.covariance.trace()), 0.06);
  EXPECT_FALSE(smoother.predict(motion.time(0.4)));
}

TEST_F(Smoother, AStepOfTheOffsetSurvivesANodeThatIsInsertedBeforeIt) {
  SmootherOptions options;
  options.window = 2.0;
  RadarSmoother smoother = make(options);
  const auto use = [&](double stamp, double t_O) {
    EXPECT_TRUE(smoother.add(measurement(stamp, t_O))) << stamp;
    smoother.optimize();
  };
  for (double stamp = 0.7; stamp < 2.0; stamp += 0.1) use(stamp, 0.0);
  ASSERT_NEAR(smoother.t_O(), 0.0, 2e-3);
  // From 2.1 on stamps are 60 ms late. The first one is placed by the old offset.
  smoother.stepOffset(motion.time(2.1));
  use(2.1, 0.06);
  EXPECT_NEAR(smoother.t_O(), 0.06, 0.015);
  // A scan from before the step, late: between two nodes.
  use(1.95, 0.0);
  // One from behind it, measured before the node of the first.
  use(2.14, 0.06);
  use(2.2, 0.06);
  EXPECT_NEAR(smoother.t_O(), 0.06, 5e-3);
  // A new start knows of no step.
  smoother.stepOffset(motion.time(2.3));
  smoother.initialize(motion.time(2.5),
                      priorAtRest(options, ImuNoise(), motion.state(2.5), 9.81, 3.0, {skewMounting()}));
  use(2.6, 0.0);
  use(2.7, 0.0);
  const Eigen::MatrixXd P = smoother.newestCovariance();
  EXPECT_LT(std::sqrt(P(StateBlock::kTangent, StateBlock::kTangent)),
            0.5 * CalibrationPrior().time_offset_sigma);
}

TEST_F(Smoother, TwoStepsOfTheOffsetWithinAWindowKeepTheirOwn) {
  SmootherOptions options;
  options.window = 2.0;
  RadarSmoother smoother = make(options);
  const auto use = [&](double from, double to, double t_O) {
    for (double stamp = from; stamp < to; stamp += 0.1) {
      EXPECT_TRUE(smoother.add(measurement(stamp, t_O))) << stamp;
      smoother.optimize();
      smoother.marginalize();
    }
  };
  use(0.7, 1.65, 0.0);
  smoother.stepOffset(motion.time(1.7));
  use(1.7, 2.05, 0.06);
  smoother.stepOffset(motion.time(2.1));
  use(2.1, 2.65, -0.03);
  EXPECT_NEAR(smoother.t_O(), -0.03, 5e-3);
  // A late scan from between the steps has the offset of its time.
  use(1.95, 1.96, 0.06);
  EXPECT_NEAR(smoother.t_O(), -0.03, 5e-3);
  // The old offsets leave with their last nodes.
  use(2.7, 4.0, -0.03);
  use(4.0, 4.05, -0.03);
  EXPECT_NEAR(smoother.t_O(), -0.03, 1e-3);
  std::size_t calibration = 0;
  for (const auto& block : smoother.states.window().blocks()) calibration += block->time ? 0 : 1;
  EXPECT_EQ(calibration, 3u);  // with the biases and the extrinsics
}

TEST(PriorAtRest, TiltAndBiasAreKnownTogether) {
  const SmootherOptions options;
  StateBlock x;
  x.q_WI() = so3::exp({0.4, -0.3, 0.9});
  const NodePrior prior = priorAtRest(options, ImuNoise(), x, 9.81, 3.0, {skewMounting()});
  const Eigen::MatrixXd P = (prior.root.J.transpose() * prior.root.J).inverse();
  const Eigen::Matrix3d R_WI = x.q_WI().toRotationMatrix();
  const Eigen::Matrix3d tilt = R_WI * P.topLeftCorner<3, 3>() * R_WI.transpose();
  // A tilt error is b_a / g.
  for (int i = 0; i < 2; ++i) EXPECT_NEAR(std::sqrt(tilt(i, i)), options.prior_sigma_accel_bias / 9.81, 3e-4);
  EXPECT_NEAR(std::sqrt(tilt(2, 2)), options.prior_sigma_yaw, 1e-6);
  // What the accelerometer reads is known by its noise, though neither of the two is.
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, StateBlock::kTangent + 1);
  J.leftCols<3>() = so3::hat(9.81 * R_WI.row(2).transpose());
  J.middleCols<3>(StateBlock::kBa).setIdentity();
  EXPECT_LT(std::sqrt((J * P * J.transpose()).trace() / 3.0), 0.02);
}

TEST(SlowMotion, IsTheMeanAroundANodeWithWeightsThatFall) {
  const SyntheticMotion motion;
  const ImuBuffer imu = motion.imu(0.0, 2.0, 400.0);
  std::vector<NodeEstimate> nodes;
  for (const double t : {0.5, 0.85, 0.95, 1.0, 1.1, 1.5}) nodes.push_back({motion.time(t), motion.state(t)});
  const Extrinsics T_IR = skewMounting();
  const SlowMotion slow = slowMotion(nodes, 3, 0.2, imu, T_IR, Extrinsics());
  const auto v_I = [&](std::size_t k) -> Eigen::Vector3d {
    return nodes[k].x.q_WI().conjugate() * nodes[k].x.v_W();
  };
  const Eigen::Vector3d mean_I = (0.25 * v_I(1) + 0.75 * v_I(2) + v_I(3) + 0.5 * v_I(4)) / 2.5;
  const Eigen::Vector3d omega_I = imu.mean(nodes[3].time, 0.2).angular_velocity - nodes[3].x.b_g();
  EXPECT_LT((slow.omega_I - omega_I).norm(), 1e-12);
  EXPECT_LT((slow.v_R - T_IR.R_RI() * (mean_I + omega_I.cross(T_IR.l_I))).norm(), 1e-9);
  EXPECT_LT(slow.T_IR.q_IR.angularDistance(Eigen::Quaterniond::Identity()), 1e-12);
}

TEST(SlowMotion, KeepsTheTurnsAndNotTheNoise) {
  const Eigen::Vector3d axis = Eigen::Vector3d(0.2, -0.5, 0.8).normalized();
  const Eigen::Vector3d across = axis.unitOrthogonal();
  const double sigma = 0.01;
  std::vector<SlowMotion> motions(20);
  std::vector<SlowMotion*> all;
  const auto set = [&](double turn, double noise) {
    all.clear();
    for (std::size_t k = 0; k < motions.size(); ++k) {
      const double sign = k % 2 == 0 ? 1.0 : -1.0;
      motions[k].omega_I = turn * axis + sign * noise * across;
      motions[k].omega_variance = sigma * sigma;
      all.push_back(&motions[k]);
    }
    keepTurns(all);
  };
  // A turn stays, and the noise about the other axes goes.
  set(0.5, 2.0 * sigma);
  for (const SlowMotion& motion : motions) EXPECT_LT((motion.omega_I - 0.5 * axis).norm(), 1e-12);
  // A rate of four sigma is a turn, too, although its sign changes from scan to scan.
  set(0.5, 4.0 * sigma);
  EXPECT_NEAR(motions[1].omega_I.dot(across), -4.0 * sigma, 1e-12);
  // Noise alone is no turn.
  set(0.0, 2.0 * sigma);
  for (const SlowMotion& motion : motions) EXPECT_LT(motion.omega_I.norm(), 1e-12);
}

}  // namespace
}  // namespace rio_t
