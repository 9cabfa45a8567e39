// One radar, from scan to window: what its answers carry.
#include "rio_t/sensors/radar_channel.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "radar_smoother.h"
#include "rio_t/smoother/node_prior.h"

namespace rio_t {
namespace {

struct OneRadar {
  OneRadar()
      : imu(motion.imu(0.0, 8.0, 200.0)),
        smoother(options.smoother, ImuNoise(), motion.g_W, imu),
        channel(withMounting(options), motion.g_W, imu, nullptr) {
    start(0.5);
  }
  static RadarChannelOptions withMounting(RadarChannelOptions& options) {
    options.radar.T_IR = skewMounting();
    options.radar.ego_velocity.doppler_quantization = 0.02;
    return options;
  }
  void start(double t) {
    smoother = FixedLagSmoother(options.smoother, ImuNoise(), motion.g_W, imu);
    channel.start(smoother, motion.time(t),
                  priorAtRest(options.smoother, ImuNoise(), motion.state(t), 9.81, 3.0, {skewMounting()}));
  }
  /// A scan of a still world, without noise.
  RadarScan scan(double stamp, int points) const {
    RadarScan scan;
    scan.stamp = motion.time(stamp);
    const Eigen::Vector3d v_R = motion.radarVelocity(stamp, skewMounting().R_RI(), skewMounting().l_I);
    for (int i = 0; i < points; ++i) {
      const double k = 100.0 * stamp + i;
      const Eigen::Vector3d u_R =
          Eigen::Vector3d(std::sin(1.3 * k), 1.0, 0.6 * std::cos(2.1 * k)).normalized();
      scan.points.push_back({5.0 * u_R, -u_R.dot(v_R), 20.0});
    }
    return scan;
  }
  RadarAnswer answer(double stamp, int points, double model_error_scale = 1.0) {
    ScanContext context;
    context.model_error_scale = model_error_scale;
    context.last_used = motion.time(stamp - 0.1);
    return channel.use(scan(stamp, points), context, smoother);
  }
  RadarAnswer use(double stamp, int points, double model_error_scale = 1.0) {
    RadarAnswer answer = this->answer(stamp, points, model_error_scale);
    smoother.optimize();
    smoother.marginalize(channel.randomWalks());
    return answer;
  }

  SyntheticMotion motion;
  ImuBuffer imu;
  RadarChannelOptions options;
  FixedLagSmoother smoother;
  RadarChannel channel;
};

// The start in motion finds the scale of the model errors itself.
TEST(RadarChannel, AVelocityForARestartHasTheSigmasAsTold) {
  const RadarAnswer plain = OneRadar().use(0.7, 30);
  const RadarAnswer scaled = OneRadar().use(0.7, 30, 9.0);
  ASSERT_TRUE(plain.alone && scaled.alone);
  EXPECT_LT((scaled.alone->covariance - plain.alone->covariance).norm(), 1e-12);
  EXPECT_LT((scaled.alone->added_variance - plain.alone->added_variance).norm(), 1e-12);
  EXPECT_GT(scaled.ego_velocity.covariance(0, 0), plain.ego_velocity.covariance(0, 0) + 1e-3);
}

TEST(RadarChannel, BorrowedPointsCountOnceForARestart) {
  OneRadar radar;
  std::vector<double> alone;
  for (double stamp = 0.7; stamp < 4.0; stamp += 0.05)
    if (radar.use(stamp, 6).alone) alone.push_back(stamp);
  ASSERT_GT(alone.size(), 8u);
  for (std::size_t i = 1; i < alone.size(); ++i) EXPECT_GT(alone[i] - alone[i - 1], 0.2) << alone[i];
}

/// A duplicate must not lend its points to the scans after it, nor teach.
TEST(RadarChannel, AScanThatComesTwiceCountsOnce) {
  OneRadar once, twice;
  std::size_t rejected = 0;
  for (double stamp = 0.7; stamp < 3.0; stamp += 0.05) {
    const int points = std::fmod(stamp, 0.5) < 0.05 ? 0 : 6;
    const RadarAnswer expected = once.use(stamp, points);
    const RadarAnswer first = twice.use(stamp, points);
    rejected += first.rejected_because.empty() ? 0 : 1;
    ASSERT_EQ(first.rejected_because, expected.rejected_because) << stamp;
    EXPECT_EQ(first.ego_velocity.v_R, expected.ego_velocity.v_R) << stamp;
    const RadarAnswer second = twice.answer(stamp, points);
    EXPECT_EQ(second.rejected_because, "duplicate_stamp");
    EXPECT_FALSE(second.was_predicted || second.innovation || second.alone);
  }
  EXPECT_EQ(once.channel.knowledge().noise.doppler, twice.channel.knowledge().noise.doppler);
  EXPECT_GT(rejected, 0u);
}

TEST(RadarChannel, AScanWithoutPointsHasTooFew) {
  OneRadar radar;
  for (double stamp = 0.7; stamp < 1.5; stamp += 0.1) ASSERT_EQ(radar.use(stamp, 30).rejected_because, "");
  EXPECT_EQ(radar.use(1.6, 0).rejected_because, "too_few_points");
}

TEST(RadarChannel, AScanWithoutPointsHasTooFewAtRestToo) {
  OneRadar radar;
  const auto atRest = [&](double stamp, int points) {
    RadarScan scan = radar.scan(stamp, points);
    for (RadarPoint& point : scan.points) point.doppler = 0.0;
    ScanContext context;
    context.rest = Rest();
    context.last_used = radar.motion.time(stamp - 0.1);
    const RadarAnswer answer = radar.channel.use(scan, context, radar.smoother);
    radar.smoother.optimize();
    return answer.rejected_because;
  };
  for (double stamp = 0.7; stamp < 0.95; stamp += 0.1) ASSERT_EQ(atRest(stamp, 6), "") << stamp;
  EXPECT_EQ(atRest(1.0, 0), "too_few_points");
}

TEST(RadarChannel, AJumpThatNoPlatformMakesIsRejected) {
  OneRadar radar;
  for (double stamp = 0.7; stamp < 1.5; stamp += 0.1) ASSERT_EQ(radar.use(stamp, 30).rejected_because, "");
  RadarScan jump = radar.scan(1.6, 30);
  for (RadarPoint& point : jump.points) point.doppler -= 60.0 * point.position_R.normalized().y();
  ScanContext context;
  context.last_used = radar.motion.time(1.5);
  EXPECT_EQ(radar.channel.use(jump, context, radar.smoother).rejected_because, "innovation");
}

/// The second order of a tilt of 0.1 rad is 0.05 m/s^2 of gravity.
TEST(RadarChannel, APredictionWithAVagueTiltRejectsNothing) {
  const auto rejected = [](double tilt_sigma) {
    OneRadar radar;
    NodePrior prior =
        priorAtRest(radar.options.smoother, ImuNoise(), radar.motion.state(0.5), 9.81, 3.0, {skewMounting()});
    prior.root.J.setIdentity();
    prior.root.J *= 1e3;
    prior.root.J.diagonal().segment<3>(StateBlock::kTheta).setConstant(1.0 / tilt_sigma);
    radar.channel.start(radar.smoother, radar.motion.time(0.5), prior);
    RadarScan jump = radar.scan(0.6, 30);
    for (RadarPoint& point : jump.points) point.doppler -= 5.0 * point.position_R.normalized().y();
    ScanContext context;
    context.last_used = radar.motion.time(0.5);
    return radar.channel.use(jump, context, radar.smoother).rejected_because;
  };
  EXPECT_EQ(rejected(0.07), "innovation");
  EXPECT_EQ(rejected(0.15), "");
}

/// The change of velocity that a borrowed Doppler gets.
TEST(RadarInWindow, TellsTheVelocityOfTheLastScansInBothModels) {
  for (const TimeOffsetModel model : {TimeOffsetModel::kImu, TimeOffsetModel::kConstantAcceleration}) {
    SmootherOptions options;
    options.time_offset_model = model;
    const SyntheticMotion motion;
    const ImuBuffer imu = motion.imu(0.0, 4.0, 200.0);
    FixedLagSmoother smoother(options, ImuNoise(), motion.g_W, imu);
    const CalibrationPrior configured{skewMounting()};
    RadarInWindow radar(options, configured, motion.g_W, imu,
                        std::make_shared<OffsetBlocks>(options, configured));
    radar.start(smoother, motion.time(1.0),
                priorAtRest(options, ImuNoise(), motion.state(1.0), 9.81, 3.0, {skewMounting()}));
    for (const double t : {1.05, 1.1, 1.15}) {
      const Eigen::Vector3d true_R = motion.radarVelocity(t, skewMounting().R_RI(), skewMounting().l_I);
      EXPECT_LT((radar.velocityAt(smoother, motion.time(t)).value() - true_R).norm(), 0.01) << t;
    }
  }
}

}  // namespace
}  // namespace rio_t
