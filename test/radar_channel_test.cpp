// One radar, from scan to window: what its answers carry.
#include "rio_t/sensors/radar_channel.h"

#include <gtest/gtest.h>

#include <cmath>

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
    options.T_IR = skewMounting();
    options.ego_velocity.doppler_quantization = 0.02;
    return options;
  }
  void start(double t) {
    smoother = FixedLagSmoother(options.smoother, ImuNoise(), motion.g_W, imu);
    channel.start(smoother, motion.time(t),
                  priorAtRest(options.smoother, ImuNoise(), motion.state(t), 9.81, 3.0, skewMounting()));
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
  RadarAnswer use(double stamp, int points, double model_error_scale = 1.0) {
    ScanContext context;
    context.model_error_scale = model_error_scale;
    context.last_used = motion.time(stamp - 0.1);
    const RadarAnswer answer = channel.use(scan(stamp, points), context, smoother);
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
  EXPECT_LT((scaled.alone->told_variance - plain.alone->told_variance).norm(), 1e-12);
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

}  // namespace
}  // namespace rio_t
